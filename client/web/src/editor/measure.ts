// How far the registration leaves pairs from where they should be. It changes nothing.
import { idOf, postJson } from '../api/http.ts';
import type { Family } from '../generated/liquidblend/v1/liquidblend_pb.ts';
import { pairJson, type Residual } from './correspondences.ts';
import type { WholePair } from './pairs.ts';

type Numbers = Record<string, number | string | undefined>;  // "Infinity" is a string

const maxPairs = 100;  // a request

function toResidual(json: Numbers): Residual {
  const read = (name: string) => Number(json[name] ?? 0);
  return {
    metres: read('residualM'),
    frames: read('residualFrames'),
    edges: read('residualEdges'),
    sourceDistanceM: read('sourceDistanceM'),
    targetDistanceM: read('targetDistanceM'),
  };
}

/** One residual for each pair. Errors: ApiError, AbortError. */
export async function measurePairs(
  family: Family,
  targetIndex: number,
  pairs: readonly WholePair[],
  signal: AbortSignal,
): Promise<Residual[]> {
  const residuals: Residual[] = [];
  for (let from = 0; from < pairs.length; from += maxPairs) {
    const correspondences = pairs.slice(from, from + maxPairs).map(pairJson);
    const request = { version: String(family.version), targetIndex, correspondences };
    const json = await postJson(`/v1/families/${idOf(family.name)}:measure`, request, signal);
    residuals.push(...((json as { residuals?: Numbers[] }).residuals ?? []).map(toResidual));
  }
  return residuals;
}

/** The mean of several residuals; undefined of none. */
export function meanResidual(residuals: readonly Residual[]): Residual | undefined {
  if (!residuals.length) return undefined;
  const mean = (of: (residual: Residual) => number) =>
    residuals.reduce((total, residual) => total + of(residual), 0) / residuals.length;
  return { metres: mean(({ metres }) => metres), frames: mean(({ frames }) => frames) };
}
