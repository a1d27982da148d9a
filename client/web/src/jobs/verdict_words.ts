// The figures of a verdict, each with what it means.
import type { RegistrationReport, Verdict } from '../generated/liquidblend/v1/liquidblend_pb.ts';

export interface VerdictFigure {
  name: string;
  value: string;
  meaning: string;
}

function percent(value: number): string {
  const shown = 100 * value;
  return `${shown.toFixed(shown !== 0 && Math.abs(shown) < 1 ? 2 : 1)} %`;
}

function largest(values: number[]): number {
  return values.reduce((most, value) => (Math.abs(value) > Math.abs(most) ? value : most), 0);
}

function surfaceFigures(verdict: Verdict): VerdictFigure[] {
  return [
    {
      name: 'Target covered',
      value: percent(verdict.coveredShare),
      meaning: 'of the target lies within a mean edge of the registered source',
    },
    {
      name: 'Source matched',
      value: percent(verdict.compatibleShare),
      meaning: 'of the source has a target near by that faces the same way',
    },
    {
      name: 'Without a counterpart',
      value: percent(verdict.unmatchedShare),
      meaning: 'of either animation in its worst twelfth of the time',
    },
    {
      name: 'Stretch',
      value: percent(verdict.stretch),
      meaning: 'mean change of distances on the surface',
    },
    {
      name: 'Inside out',
      value: percent(verdict.invertedShare),
      meaning: 'of the surface is folded over',
    },
  ];
}

function blendFigures(verdict: Verdict): VerdictFigure[] {
  return [
    {
      name: 'Volume half-way',
      value: percent(largest(verdict.volumeErrors)),
      meaning: 'largest difference from the mean of both animations',
    },
    {
      name: 'Relief lost',
      value: percent(verdict.reliefLoss),
      meaning: 'how much flatter craters, jets and waves of blends are',
    },
    {
      name: 'Number of parts',
      value: verdict.componentError.toFixed(2),
      meaning: 'parts too many or too few, on average',
    },
  ];
}

function partFigures(verdict: Verdict): VerdictFigure[] {
  if (!verdict.partShift && !verdict.partVolumeError && !verdict.partFallError) return [];
  return [
    {
      name: 'Drops: place',
      value: percent(verdict.partShift),
      meaning: 'of their diameter away from where they should be',
    },
    {
      name: 'Drops: volume',
      value: percent(verdict.partVolumeError),
      meaning: 'away from what lies between both animations',
    },
    {
      name: 'Drops: fall',
      value: percent(verdict.partFallError),
      meaning: 'away from the acceleration of free fall',
    },
  ];
}

export function verdictFigures(verdict: Verdict): VerdictFigure[] {
  return [...surfaceFigures(verdict), ...blendFigures(verdict), ...partFigures(verdict)];
}

/** How the registration itself went. */
export function reportFigures(report: RegistrationReport): VerdictFigure[] {
  return [
    {
      name: 'Mean distance',
      value: `${report.meanResidualEdges.toFixed(3)} edges`,
      meaning: 'from the registered source to the target, in mean edge lengths',
    },
    {
      name: 'Inliers',
      value: percent(report.inlierShare),
      meaning: 'of the samples found a partner',
    },
    {
      name: 'Work',
      value: `${report.seconds.toFixed(1)} s`,
      meaning: `${report.numIterations} iterations, ${report.numNodes} nodes`,
    },
  ];
}
