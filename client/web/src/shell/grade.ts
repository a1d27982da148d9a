// The verdict of a family's registrations in a word.
import { Verdict_Grade, type Family } from '../generated/liquidblend/v1/liquidblend_pb.ts';

export interface GradeMark {
  kind: 'good' | 'doubtful' | 'bad';
  text: string;
}

const marks: Partial<Record<Verdict_Grade, GradeMark>> = {
  [Verdict_Grade.GOOD]: { kind: 'good', text: 'good' },
  [Verdict_Grade.DOUBTFUL]: { kind: 'doubtful', text: 'doubtful' },
  [Verdict_Grade.TOO_DIFFERENT]: { kind: 'bad', text: 'too different' },
};

/** That of its worst target. */
export function gradeOf(family: Family): GradeMark | undefined {
  const grades = family.reports.map((report) => report.verdict?.grade ?? 0);
  return marks[Math.max(0, ...grades) as Verdict_Grade];
}
