// How far the registration leaves pairs from where they should be. It changes nothing.
import { idOf, postJson } from '../api/http.ts';
import type { Family } from '../generated/liquidblend/v1/liquidblend_pb.ts';
import { pairJson, type Residual } from './correspondences.ts';
import type { WholePair } from './pairs.ts';

interface MeasuredJson {
  residuals?: {
    residualM?: number;
    residualFrames?: number;
    residualEdges?: number;
    sourceDistanceM?: number;
    targetDistanceM?: number;
  }[];
}

/** One residual for each pair. Errors: ApiError, AbortError. */
export async function measurePairs(
  family: Family,
  targetIndex: number,
  pairs: readonly WholePair[],
  signal: AbortSignal,
): Promise<Residual[]> {
  const request = {
    version: String(family.version),
    targetIndex,
    correspondences: pairs.map(pairJson),
  };
  const json = await postJson(`/v1/families/${idOf(family.name)}:measure`, request, signal);
  return ((json as MeasuredJson).residuals ?? []).map((residual) => ({
    metres: residual.residualM ?? 0,
    frames: residual.residualFrames ?? 0,
    edges: residual.residualEdges ?? 0,
    sourceDistanceM: residual.sourceDistanceM ?? 0,
    targetDistanceM: residual.targetDistanceM ?? 0,
  }));
}

/** The mean of several residuals; undefined of none. */
export function meanResidual(residuals: readonly Residual[]): Residual | undefined {
  if (!residuals.length) return undefined;
  const mean = (of: (residual: Residual) => number) =>
    residuals.reduce((total, residual) => total + of(residual), 0) / residuals.length;
  return { metres: mean(({ metres }) => metres), frames: mean(({ frames }) => frames) };
}
