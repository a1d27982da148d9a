// Import and export of pairs. A file that was read and not changed is written as it was.
import { formatPairs, parsePairs, type FilePair } from './pair_file.ts';
import { appendPairs, checkPairs, sentPairs, type PairList } from './pairs.ts';

interface Imported {
  text: string;
  stamp: string;
}

function stampOf(pairs: readonly (readonly FilePair[])[]): string {
  return JSON.stringify(
    pairs.map((list) =>
      list.map(({ kind, hard, lengthS, source, target }) => [kind, hard, lengthS, source, target]),
    ),
  );
}

// The pairs of the other sort stay; the new ones have numbers that none had before.
function withFile(list: PairList, added: readonly FilePair[], check: boolean): PairList {
  const kept = list.pairs.filter((pair) => pair.check !== check);
  return appendPairs(
    { ...list, pairs: kept },
    added.map((pair) => ({ ...pair, check })),
  );
}

export class PairFiles {
  private readonly imported: Partial<Record<'own' | 'checks', Imported>> = {};

  /** The lists with the file's pairs. Errors: throws, with the reason. */
  read(text: string, name: string, asChecks: boolean, lists: readonly PairList[]): PairList[] {
    const files = parsePairs(text, name);
    if (files.length !== lists.length) {
      throw new Error(
        `${name}: has ${files.length} lists, but the family has ${lists.length} targets`,
      );
    }
    this.imported[asChecks ? 'checks' : 'own'] = { text, stamp: stampOf(files) };
    return lists.map((list, target) => withFile(list, files[target]!, asChecks));
  }

  /** The text of a file of the pairs that are sent, or of the check pairs. */
  write(lists: readonly PairList[], checks: boolean): string {
    const pairs = lists.map(checks ? checkPairs : sentPairs);
    const imported = this.imported[checks ? 'checks' : 'own'];
    return imported?.stamp === stampOf(pairs) ? imported.text : formatPairs(pairs);
  }

  forget(): void {
    delete this.imported.own;
    delete this.imported.checks;
  }
}
