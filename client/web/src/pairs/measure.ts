// How far the registration leaves pairs from where they should be. It changes nothing.
import { idOf, postJson } from '../api/http.ts';
import { fromServer } from '../api/messages.ts';
import {
  MeasureCorrespondencesResponseSchema,
  type Family,
  type MeasureCorrespondencesResponse_Residual as MeasuredResidual,
} from '../generated/liquidblend/v1/liquidblend_pb.ts';
import { pairJson, type Residual } from './correspondences.ts';
import type { WholePair } from './pairs.ts';

const maxPairs = 100;  // a request

function toResidual(measured: MeasuredResidual): Residual {
  const { residualM, residualFrames, residualEdges, sourceDistanceM, targetDistanceM } = measured;
  return {
    metres: residualM,
    frames: residualFrames,
    edges: residualEdges,
    sourceDistanceM,
    targetDistanceM,
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
    const response = fromServer(MeasureCorrespondencesResponseSchema, json);
    residuals.push(...response.residuals.map(toResidual));
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
