// What was marked and not yet registered, kept in the browser.
import { emptyList, type Pair, type PairList } from './pairs.ts';

interface Stored {
  version: string;  // of the family that it was marked on
  lists: PairList[];
}

const prefix = 'liquidblend.pairs.';

function isList(value: unknown): value is PairList {
  const list = value as Partial<PairList> | null;
  return (
    typeof list === 'object' &&
    list !== null &&
    Array.isArray(list.pairs) &&
    Array.isArray(list.dropped) &&
    typeof list.nextNumber === 'number'
  );
}

export function loadLists(family: string): Stored | undefined {
  try {
    const stored = JSON.parse(localStorage.getItem(prefix + family) ?? 'null') as Stored | null;
    return stored && Array.isArray(stored.lists) && stored.lists.every(isList) ? stored : undefined;
  } catch {
    return undefined;  // storage is switched off, or holds something else
  }
}

export function saveLists(family: string, version: bigint, lists: readonly PairList[]): void {
  try {
    localStorage.setItem(prefix + family, JSON.stringify({ version: String(version), lists }));
  } catch {
    // Then they live as long as the page.
  }
}

/** The pairs that a family was registered with, and the check pairs that were marked before. */
export function startList(
  own: readonly Omit<Pair, 'number'>[],
  stored: PairList | undefined,
): PairList {
  const checks = stored?.pairs.filter(({ check }) => check) ?? [];
  const first = checks.reduce((most, { number }) => Math.max(most, number), 0) + 1;
  const pairs = own.map((pair, index) => ({ ...pair, number: first + index }));
  const nextNumber = Math.max(stored?.nextNumber ?? 1, first + own.length);
  return { ...emptyList, pairs: [...checks, ...pairs], nextNumber };
}
