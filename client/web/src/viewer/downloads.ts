// What can be downloaded of the picture in front.
import { send } from '../api/http.ts';
import { openSink, saveBlob } from '../base/save.ts';
import { Up } from '../generated/liquidblend/v1/liquidblend_pb.ts';
import { exportAnimation } from '../stream/export.ts';
import {
  framePath,
  isFamily,
  type FileFormat,
  type FrameRequest,
} from '../stream/frame_request.ts';
import type { ViewModel } from '../view/model.ts';
import type { Pane } from '../view/panes.ts';

export type What = 'frame' | 'picture' | 'animation';

const upNames: Partial<Record<Up, string>> = {
  [Up.X]: 'x',
  [Up.Y]: 'y',
  [Up.Z]: 'z',
  [Up.MINUS_X]: '-x',
  [Up.MINUS_Y]: '-y',
  [Up.MINUS_Z]: '-z',
};

function requestOf(model: ViewModel, pane: Pane): FrameRequest {
  const { subject } = pane.info!;
  const { level, blend } = model.settings(pane);
  const levelOfDetail = level === 'auto' || !isFamily(subject) ? 0 : level;
  return { subject, blend, timeS: pane.picture?.player?.timeS ?? 0, levelOfDetail };
}

function stemOf(pane: Pane): string {
  return pane.info!.subject.name.replace(/^.*\//, '');
}

function metaOf(model: ViewModel, pane: Pane): object {
  const { subject, timing, family, animation } = pane.info!;
  const up = upNames[family?.up ?? animation?.up ?? Up.UNSPECIFIED];
  const weights = model.weights(pane);
  return {
    fps: timing.framesPerSecond,
    units: { vertex_scale: 1, velocity_scale_to_m_per_s: 1 },
    ...(up ? { up } : {}),
    about: family
      ? { family: subject.name, version: Number(subject.version || family.version), weights }
      : { animation: subject.name },
  };
}

async function saveFrame(model: ViewModel, pane: Pane, format: FileFormat, signal: AbortSignal) {
  const request = requestOf(model, pane);
  const response = await send(framePath(request, format), { signal });
  saveBlob(await response.blob(), `${stemOf(pane)}_${request.timeS.toFixed(3)}s.${format}`);
}

async function savePicture(pane: Pane) {
  const { picture } = pane;
  if (!picture) return;
  saveBlob(
    await picture.toPng(),
    `${stemOf(pane)}_${(picture.player?.timeS ?? 0).toFixed(3)}s.png`,
  );
}

/** Errors: ApiError, or AbortError if it was cancelled. */
export async function download(
  model: ViewModel,
  what: What,
  format: FileFormat,
  signal: AbortSignal,
  progress: (done: number, all: number) => void,
): Promise<void> {
  const pane = model.main;
  if (!pane?.info) return;
  if (what === 'picture') return savePicture(pane);
  if (what === 'frame') return saveFrame(model, pane, format, signal);
  const sink = await openSink(`${stemOf(pane)}_${format}.tar`);
  const { timing } = pane.info;
  const request = requestOf(model, pane);
  await exportAnimation(
    { request, timing, format, meta: metaOf(model, pane) },
    sink,
    signal,
    progress,
  );
}
