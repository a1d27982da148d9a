// Progress and verdicts in words.
import { Verdict_Grade } from '../generated/liquidblend/v1/liquidblend_pb.ts';
import type { Progress } from '../generated/liquidblend/v1/liquidblend_pb.ts';
import type { JobState } from '../api/operations.ts';

const stages: Record<string, string> = {
  queued: 'Waiting for its turn',
  starting: 'Starting',
  'space-time meshes': 'Building the space-time meshes',
  registration: 'Matching',
  projection: 'Drawing the surfaces together',
  storing: 'Storing',
  'levels of detail': 'Making levels of detail',
  publishing: 'Publishing',
};

export function stageText(progress: Progress | undefined): string {
  const stage = progress?.stage ?? '';
  return stages[stage] ?? (stage ? stage[0]!.toUpperCase() + stage.slice(1) : 'Waiting');
}

/** "45 s", "3 min", "2 h 10 min". */
export function spanText(seconds: number): string {
  if (seconds < 90) return `${Math.max(1, Math.round(seconds))} s`;
  const minutes = Math.round(seconds / 60);
  if (minutes < 60) return `${minutes} min`;
  return `${Math.floor(minutes / 60)} h ${minutes % 60} min`;
}

export function leftText(progress: Progress | undefined): string {
  const seconds = progress?.secondsLeft ?? 0;
  return seconds > 0 ? `about ${spanText(seconds)} left` : '';
}

export interface Figure {
  name: string;
  value: string;
}

function share(part: bigint, whole: bigint): string {
  return whole ? `${((100 * Number(part)) / Number(whole)).toFixed(1)} %` : '';
}

/** What a registration tells while it runs. */
export function progressFigures(progress: Progress | undefined): Figure[] {
  if (!progress) return [];
  const { iteration, numIterations, fitEnergy, smoothnessEnergy, numInliers, numSamples } =
    progress;
  const figures: Figure[] = [];
  if (numIterations) figures.push({ name: 'iteration', value: `${iteration} of ${numIterations}` });
  if (fitEnergy) figures.push({ name: 'fit energy', value: fitEnergy.toPrecision(4) });
  if (smoothnessEnergy) {
    figures.push({ name: 'smoothness energy', value: smoothnessEnergy.toPrecision(4) });
  }
  if (numSamples) figures.push({ name: 'inliers', value: share(numInliers, numSamples) });
  if (progress.attempt > 1) figures.push({ name: 'attempt', value: String(progress.attempt) });
  if (progress.secondsElapsed >= 1) {
    figures.push({ name: 'elapsed', value: spanText(progress.secondsElapsed) });
  }
  return figures;
}

export const stateTexts: Record<JobState, string> = {
  running: 'running',
  done: 'done',
  failed: 'failed',
  cancelled: 'cancelled',
};

export interface GradeWords {
  kind: 'good' | 'doubtful' | 'bad' | 'none';
  title: string;
  text: string;
}

const grades: Record<Verdict_Grade, GradeWords> = {
  [Verdict_Grade.GRADE_UNSPECIFIED]: {
    kind: 'none',
    title: 'no verdict',
    text: 'An older program registered this target and left no verdict.',
  },
  [Verdict_Grade.GOOD]: {
    kind: 'good',
    title: 'good',
    text: 'Blends are as good as the method makes them.',
  },
  [Verdict_Grade.DOUBTFUL]: {
    kind: 'doubtful',
    title: 'doubtful',
    text: 'Look at the place and time below. Pairs marked there may help.',
  },
  [Verdict_Grade.TOO_DIFFERENT]: {
    kind: 'bad',
    title: 'too different',
    text: 'The two animations show different events. Their blends will look like neither.',
  },
};

export function gradeWords(grade: Verdict_Grade): GradeWords {
  return grades[grade] ?? grades[Verdict_Grade.GRADE_UNSPECIFIED];
}
