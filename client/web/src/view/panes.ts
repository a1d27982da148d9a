// What stands side by side.
import type { ApiError } from '../api/errors.ts';
import type { Family } from '../generated/liquidblend/v1/liquidblend_pb.ts';
import type { Picture } from './picture.ts';
import type { Beside } from './state.ts';
import type { SubjectInfo } from './subject.ts';

/** What one pane shows. It keeps its canvas while that changes. */
export interface Pane {
  readonly key: 'main' | Beside;
  title: string;
  info: SubjectInfo | undefined;
  picture: Picture | undefined;
  error: ApiError | undefined;
  told: string; // what elements know of its player
}

export function newPane(key: Pane['key']): Pane {
  return { key, title: '', info: undefined, picture: undefined, error: undefined, told: '' };
}

/** Prepares a pane for something else. */
export function clear(pane: Pane): void {
  pane.picture?.clear();
  pane.info = undefined;
  pane.error = undefined;
}

export function titleOf(name: string): string {
  return name.slice(name.indexOf('/') + 1);
}

/** What a key such as target.2 stands for in a family. Errors: throws if there is no such thing. */
export function resolve(
  key: Beside,
  family: Family | undefined,
): { name: string; version: bigint; title: string } {
  if (!family) throw new Error('Only families have something beside them.');
  const [kind, number = '0'] = key.split('.') as [string, string?];
  if (kind === 'version') {
    return { name: family.name, version: BigInt(number), title: `version ${number}` };
  }
  const name = kind === 'source' ? family.source : family.targets[Number(number) - 1];
  if (!name) throw new Error(`This family has no target ${number}.`);
  const role = kind === 'source' ? 'source' : `target ${number}`;
  return { name, version: 0n, title: `${role}: ${titleOf(name)}` };
}
