// What keys do in the editor, wherever the focus is but for fields and dialogs.
import { pairOf, type Kind, type Side } from '../pairs/pairs.ts';
import type { EditorModel } from './model.ts';

const nextKind: Record<Kind, Kind> = { POINT: 'TRAJECTORY', TRAJECTORY: 'SPACE', SPACE: 'POINT' };

type Act = (model: EditorModel) => void;

function ofSelected(change: (model: EditorModel, number: number) => void): Act {
  return (model) => {
    if (pairOf(model.list, model.selected)) change(model, model.selected);
  };
}

function stepTime(side: Side, frames: number): Act {
  return (model) => model.setTime(side, model.times[side] + frames * model.frameS(side));
}

const acts: Record<string, Act> = {
  Delete: ofSelected((model, number) => model.deletePair(number)),
  Backspace: ofSelected((model, number) => model.deletePair(number)),
  x: ofSelected((model, number) => model.pairs.toggleEnabled(number)),
  h: ofSelected((model, number) =>
    model.pairs.patchPair(number, { hard: !pairOf(model.list, number)!.hard }),
  ),
  t: ofSelected((model, number) =>
    model.pairs.patchPair(number, { kind: nextKind[pairOf(model.list, number)!.kind] }),
  ),
  c: ofSelected((model, number) =>
    model.pairs.patchPair(number, { check: !pairOf(model.list, number)!.check }),
  ),
  e: ofSelected((model, number) => model.pairs.endAt(number, model.times.source)),
  n: (model) => model.step(1),
  p: (model) => model.step(-1),
  ',': stepTime('source', -1),
  '.': stepTime('source', 1),
  '<': stepTime('target', -1),
  '>': stepTime('target', 1),
  f: (model) => model.fit(),
};

function isField(element: EventTarget | undefined): boolean {
  if (element instanceof HTMLInputElement)
    return element.type !== 'range' && element.type !== 'checkbox';
  return (
    element instanceof HTMLSelectElement ||
    element instanceof HTMLTextAreaElement ||
    (element instanceof Element && !!element.closest('dialog'))
  );
}

function history(event: KeyboardEvent): Act | undefined {
  if (!(event.ctrlKey || event.metaKey) || event.altKey) return undefined;
  const key = event.key.toLowerCase();
  if (key === 'y' || (key === 'z' && event.shiftKey)) return (model) => model.pairs.redo();
  return key === 'z' ? (model) => model.pairs.undo() : undefined;
}

/** Whether the key does not belong to the control that has the focus. */
export function isFree(event: KeyboardEvent): boolean {
  return !event.defaultPrevented && !isField(event.composedPath()[0]);
}

/** undefined: the key means nothing here, or is not free. */
export function actOf(event: KeyboardEvent): Act | undefined {
  if (!isFree(event)) return undefined;
  if (event.ctrlKey || event.metaKey || event.altKey) return history(event);
  return Object.hasOwn(acts, event.key) ? acts[event.key] : undefined;
}
