// Pairs as the API's correspondences, and what registrations said of them.
import type { Json } from '../api/changes.ts';
import {
  Correspondence_Kind,
  CorrespondenceReport_Outcome,
  type Correspondence,
  type CorrespondenceReport,
  type Event,
  type Family,
} from '../generated/liquidblend/v1/liquidblend_pb.ts';
import {
  distanceBetween,
  type Kind,
  type SpaceTime,
  type Vector,
  type WholePair,
} from './pairs.ts';

/** How far a registration leaves a pair from where it should be. */
export interface Residual {
  metres: number;
  frames: number;
  edges?: number | undefined;
  sourceDistanceM?: number | undefined;  // of the place from its surface
  targetDistanceM?: number | undefined;
  outcome?: 'kept' | 'overruled' | undefined;  // of a registration that had it
}

/** A pair that the registration found. */
export interface AutomaticPair {
  key: string;
  pair: Omit<WholePair, 'number'>;
  confidence: number;
  residual: Residual;
}

const kindNames: Record<Correspondence_Kind, Kind> = {
  [Correspondence_Kind.KIND_UNSPECIFIED]: 'POINT',
  [Correspondence_Kind.POINT]: 'POINT',
  [Correspondence_Kind.TRAJECTORY]: 'TRAJECTORY',
  [Correspondence_Kind.SPACE]: 'SPACE',
};

function toPlace(event: Event | undefined): SpaceTime {
  const { x = 0, y = 0, z = 0 } = event?.position ?? {};
  return { position: [x, y, z], timeS: event?.timeS ?? 0 };
}

export function toPair(correspondence: Correspondence | undefined): Omit<WholePair, 'number'> {
  return {
    kind: kindNames[correspondence?.kind ?? Correspondence_Kind.POINT],
    hard: correspondence?.hard ?? false,
    lengthS: correspondence?.lengthS ?? 0,
    source: toPlace(correspondence?.source),
    target: toPlace(correspondence?.target),
    enabled: true,
    check: false,
  };
}

function eventJson({ position: [x, y, z], timeS }: SpaceTime): Json {
  return { position: { x, y, z }, timeS };
}

export function pairJson({ kind, hard, lengthS, source, target }: Omit<WholePair, 'number'>): Json {
  const length = kind === 'POINT' ? {} : { lengthS };
  return { kind, hard, source: eventJson(source), target: eventJson(target), ...length };
}

function residualOf(report: CorrespondenceReport): Residual {
  const overruled = report.outcome === CorrespondenceReport_Outcome.OVERRULED;
  return {
    metres: report.residualM,
    frames: report.residualFrames,
    outcome: overruled ? 'overruled' : 'kept',
  };
}

function reportsOf(family: Family, target: number, automatic: boolean): CorrespondenceReport[] {
  const all = family.reports[target]?.correspondences ?? [];
  return all.filter((report) => report.automatic === automatic);
}

/** The user's pairs of a target, as the family was registered with. */
export function ownPairs(family: Family, target: number): Omit<WholePair, 'number'>[] {
  return reportsOf(family, target, false).map(({ correspondence }) => toPair(correspondence));
}

function keyOf({ source, target, kind }: Omit<WholePair, 'number'>): string {
  return JSON.stringify([kind, source.position, source.timeS, target.position, target.timeS]);
}

export function automaticPairs(family: Family, target: number): AutomaticPair[] {
  return reportsOf(family, target, true).map((report) => {
    const pair = toPair(report.correspondence);
    return { key: keyOf(pair), pair, confidence: report.confidence, residual: residualOf(report) };
  });
}

/** Whether both are the same, but for the rounding of a registration. */
export function isSamePair(a: Omit<WholePair, 'number'>, b: Omit<WholePair, 'number'>): boolean {
  return a.kind === b.kind && isNear(a.source, b.source) && isNear(a.target, b.target);
}

function isNear(a: SpaceTime, b: SpaceTime): boolean {
  const size = 1 + Math.hypot(...(a.position as Vector));
  return (
    distanceBetween(a.position, b.position) < 1e-5 * size && Math.abs(a.timeS - b.timeS) < 1e-4
  );
}

/** What the family's registration says of each pair, by its number. It rounds what it is given. */
export function registeredResiduals(
  family: Family,
  target: number,
  pairs: readonly WholePair[],
): Map<number, Residual> {
  const left = [...pairs];
  const found = new Map<number, Residual>();
  for (const report of reportsOf(family, target, false)) {
    const was = toPair(report.correspondence);
    const at = left.findIndex((pair) => isSamePair(pair, was));
    if (at < 0) continue;
    const [pair] = left.splice(at, 1);
    found.set(pair!.number, residualOf(report));
  }
  return found;
}
