// A family's parameter space with the server's simplices.
import { getJson, idOf } from '../api/http.ts';
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

interface SpaceJson {
  parameterSpace?: { simplices?: { animations?: number[] }[] };
}

function simplicesOf(json: unknown, numPoints: number): number[][] {
  const { parameterSpace } = json as SpaceJson;
  const all = (parameterSpace?.simplices ?? []).map(({ animations }) => animations ?? []);
  const areKnown = all.every((simplex) =>
    simplex.every((index) => index >= 0 && index < numPoints),
  );
  return areKnown ? all : [];
}

/** undefined: frames of the family are asked for by weights only. Errors: ApiError, AbortError. */
export async function loadSpace(
  family: Family,
  version: bigint,
  signal: AbortSignal,
): Promise<FamilySpace | undefined> {
  const { parameterSpace } = family;
  if (!parameterSpace?.names.length) return undefined;
  const query = version ? { version: String(version) } : {};
  const json = await getJson(`/v1/families/${idOf(family.name)}`, query, signal);
  const points = parameterSpace.points.map(({ values }) => values);
  return {
    space: new PointSpace(parameterSpace.names, points, simplicesOf(json, points.length)),
    isSmooth: parameterSpace.interpolation === ParameterSpace_Interpolation.SMOOTH,
    labels: [family.source, ...family.targets].map((name) => name.slice(name.indexOf('/') + 1)),
  };
}
