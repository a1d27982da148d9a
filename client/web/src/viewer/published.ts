// What tests and the curious read at window.liquidblend. Nothing can be changed there.
import type { ViewModel } from '../view/model.ts';
import type { Pane } from '../view/panes.ts';

function describe({ title, picture, error }: Pane) {
  const player = picture?.player;
  const info = picture?.shown?.info;
  const { memory, programs } = picture?.stage.renderer.info ?? {};
  return {
    title,
    error: error?.message ?? '',
    playing: player?.playing ?? false,
    connection: player?.connection ?? 'closed',
    timeS: player?.timeS ?? 0,
    settled: picture?.settled ?? false,
    shown: picture?.numShown ?? 0,
    skipped: picture?.numSkipped ?? 0,
    late: player?.numLate ?? 0,
    overtaken: player?.numOvertaken ?? 0,
    received: player?.numReceived ?? 0,
    orderViolations: picture?.orderViolations ?? 0,
    running: player?.numRunning ?? 0,
    waiting: player?.numWaiting ?? 0,
    mostWaiting: player?.mostWaiting ?? 0,
    lastShown: info && { ...info, atMs: picture?.shown?.atMs ?? 0, ...picture?.shown?.counts },
    mainMs: {
      mean: picture?.mainMs.mean ?? 0,
      median: picture?.mainMs.percentile(0.5) ?? 0,
      p95: picture?.mainMs.percentile(0.95) ?? 0,
    },
    decodeMs: { mean: picture?.decodeMs.mean ?? 0, p95: picture?.decodeMs.percentile(0.95) ?? 0 },
    pixelRatio: picture?.pixelRatio ?? 0,
    renderer: {
      ...memory,
      programs: programs?.length ?? 0,
      grown: picture?.stage.surface.numGrown ?? 0,
    },
  };
}

export function publish(model: ViewModel): void {
  const liquidblend = Object.freeze({
    get panes() {
      return structuredClone(model.panes.map(describe));
    },
    get decoded() {
      return model.pool.numDecoded;
    },
    get buffersMade() {
      return model.pool.buffers.numMade;
    },
    get state() {
      return structuredClone({ ...model.state, version: String(model.state.version) });
    },
  });
  Object.defineProperty(window, 'liquidblend', { value: liquidblend, configurable: true });
}
