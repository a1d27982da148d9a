// What the viewer's keys do.
import { clamp, roundTo } from '../base/numbers.ts';
import type { Loop } from '../stream/clock.ts';
import type { Action } from './keys.ts';
import type { ViewModel } from './model.ts';
import type { Pane } from './panes.ts';

type Act = (model: ViewModel, pane: Pane) => void;

const loops: Loop[] = ['off', 'whole', 'range'];

function timeOf(pane: Pane): number {
  return pane.picture?.player?.timeS ?? 0;
}

function durationOf(pane: Pane): number {
  return pane.info?.timing.durationS ?? 0;
}

function step(frames: number): Act {
  return (model, pane) => {
    if (pane.picture?.player?.playing) model.togglePlay(pane);
    const timeS = timeOf(pane) + frames / (pane.info?.timing.framesPerSecond ?? 24);
    model.seek(pane, clamp(timeS, 0, durationOf(pane)), true);
  };
}

function setRange(end: 0 | 1): Act {
  return (model, pane) => {
    const { loop, range } = model.state;
    const now: [number, number] = loop === 'range' ? [...range] : [0, roundTo(durationOf(pane), 4)];
    now[end] = roundTo(timeOf(pane), 4);
    model.patch({ loop: 'range', range: now });
  };
}

export const actions: Partial<Record<Action, Act>> = {
  play: (model, pane) => model.togglePlay(pane),
  previousFrame: step(-1),
  nextFrame: step(1),
  begin: (model, pane) => model.seek(pane, 0, true),
  end: (model, pane) => model.seek(pane, durationOf(pane), true),
  loop: (model) => model.setLoop(loops[(loops.indexOf(model.state.loop) + 1) % loops.length]!),
  rangeBegin: setRange(0),
  rangeEnd: setRange(1),
  shading: (model) =>
    model.patch({ shading: model.state.shading === 'liquid' ? 'plain' : 'liquid' }),
  wireframe: (model) => model.patch({ wireframe: !model.state.wireframe }),
  pattern: (model) => model.patch({ pattern: !model.state.pattern }),
  fit: (model) => model.fit(),
};
