// A family's parameter space with the server's simplices.
import {
  ParameterSpace_Interpolation,
  type Family,
} from '../generated/liquidblend/v1/liquidblend_pb.ts';
import { PointSpace } from './space.ts';

export interface FamilySpace {
  space: PointSpace;
  isSmooth: boolean;
  labels: string[];  // of the points: the names of the animations
}

/** undefined: frames of the family are asked for by weights only. */
export function familySpace({ parameterSpace, source, targets }: Family): FamilySpace | undefined {
  if (!parameterSpace?.names.length) return undefined;
  const { names, points, simplices, interpolation } = parameterSpace;
  return {
    space: new PointSpace(
      names,
      points.map(({ values }) => values),
      simplices.map(({ animations }) => animations),
    ),
    isSmooth: interpolation === ParameterSpace_Interpolation.SMOOTH,
    labels: [source, ...targets].map((name) => name.slice(name.indexOf('/') + 1)),
  };
}
