// Keys of the viewer, wherever the focus is but for fields, lists and dialogs.
export type Action =
  | 'play'
  | 'previousFrame'
  | 'nextFrame'
  | 'begin'
  | 'end'
  | 'loop'
  | 'rangeBegin'
  | 'rangeEnd'
  | 'shading'
  | 'wireframe'
  | 'pattern'
  | 'fit'
  | 'download'
  | 'help';

export const keys: Record<string, Action> = {
  ' ': 'play',
  k: 'play',
  ',': 'previousFrame',
  '.': 'nextFrame',
  Home: 'begin',
  End: 'end',
  l: 'loop',
  '[': 'rangeBegin',
  ']': 'rangeEnd',
  s: 'shading',
  w: 'wireframe',
  p: 'pattern',
  f: 'fit',
  d: 'download',
  '?': 'help',
};

function takesKeys(element: EventTarget | undefined, key: string): boolean {
  if (!(element instanceof HTMLElement)) return false;
  if (element.closest('dialog')) return true;
  if (element instanceof HTMLSelectElement || element instanceof HTMLTextAreaElement) return true;
  if (element instanceof HTMLInputElement)
    return element.type !== 'range' || key === 'Home' || key === 'End';
  return (
    key === ' ' && (element instanceof HTMLButtonElement || element instanceof HTMLAnchorElement)
  );
}

/** What a key asks for; undefined if it belongs to the control that has the focus. */
export function actionOf(event: KeyboardEvent): Action | undefined {
  if (event.defaultPrevented || event.ctrlKey || event.metaKey || event.altKey) return undefined;
  if (takesKeys(event.composedPath()[0], event.key)) return undefined;
  return keys[event.key];
}
