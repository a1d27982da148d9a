// What was marked and not yet registered, kept in the browser.
import { isSamePair } from './correspondences.ts';
import { appendPairs, emptyList, isWhole, type PairList, type WholePair } from './pairs.ts';

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

/**
 * The pairs that were marked before, whatever became of the family since, and after them those
 * that it was registered with and that are not among them.
 */
export function startList(
  own: readonly Omit<WholePair, 'number'>[],
  stored: PairList = emptyList,
): PairList {
  const left = stored.pairs.filter(isWhole);
  const added = own.filter((pair) => {
    const at = left.findIndex((known) => !known.check && isSamePair(known, pair));
    if (at >= 0) left.splice(at, 1);
    return at < 0;
  });
  return appendPairs(stored, added);
}
