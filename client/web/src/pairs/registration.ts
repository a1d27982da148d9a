// "Register again": the request that an editor's pairs make.
import { toJson } from '@bufbuild/protobuf';
import type { Json } from '../api/changes.ts';
import {
  ParameterSpaceSchema,
  TimeBlending_Kind,
  type Family,
} from '../generated/liquidblend/v1/liquidblend_pb.ts';
import { automaticPairs, pairJson } from './correspondences.ts';
import { sentPairs, type PairList, type WholePair } from './pairs.ts';

export interface AgainOptions {
  fromScratch: boolean;
  iterations: number;  // 0: as usual
  findPairs: boolean;  // automatic pairs, too
}

/** The automatic pairs of a target that were not dropped. */
export function keptPairs(
  family: Family,
  target: number,
  { dropped }: PairList,
): Omit<WholePair, 'number'>[] {
  const kept = automaticPairs(family, target).filter(({ key }) => !dropped.includes(key));
  return kept.map(({ pair }) => pair);
}

export function dropsSome(lists: readonly PairList[]): boolean {
  return lists.some(({ dropped }) => dropped.length > 0);
}

function spaceOf({ parameterSpace }: Family): Json {
  if (!parameterSpace) return {};
  return { parameterSpace: toJson(ParameterSpaceSchema, { ...parameterSpace, simplices: [] }) };
}

// As the family has it, unless the worker chose it.
function blendingOf({ timeBlending }: Family): Json {
  if (!timeBlending || timeBlending.reason) return {};
  const { kind, restTimeS } = timeBlending;
  return { timeBlending: { kind: TimeBlending_Kind[kind], restTimeS } };
}

function scratchFields(family: Family): Json {
  const { source, targets } = family;
  return { replace: true, source, targets, ...spaceOf(family), ...blendingOf(family) };
}

export function againRequest(
  family: Family,
  lists: readonly PairList[],
  options: AgainOptions,
): Json {
  const { fromScratch, iterations, findPairs } = options;
  // Where one automatic pair is dropped, the others are sent as the user's, those of other targets,
  // too: the registration finds none.
  const drops = dropsSome(lists);
  const correspondences = lists.map((list, target) => {
    const kept = drops ? keptPairs(family, target, list) : [];
    return { correspondences: [...sentPairs(list), ...kept].map(pairJson) };
  });
  return {
    familyId: family.name,
    ...(fromScratch ? scratchFields(family) : { refine: true }),
    options: {
      ...(iterations > 0 ? { maxIterations: iterations } : {}),
      automaticCorrespondences: findPairs && !drops,
    },
    correspondences,
  };
}

/** Which pair an error's "correspondence 2" is: those that are sent are counted from 0. */
export function sentNumbers(list: PairList): string {
  return sentPairs(list)
    .map((pair, index) => `${index} is pair ${pair.number}`)
    .join(', ');
}
