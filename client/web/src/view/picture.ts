// One picture that moves: takes frames from its player, draws the newest one once per animation
// frame of the browser, and counts. This is the hot path, so it is no element.
import { Meter, Rate } from '../base/meter.ts';
import { measured, takeSpent } from '../base/work.ts';
import { fitted, type Orbit } from '../scene/orbit.ts';
import { Stage, type Look } from '../scene/stage.ts';
import type { DecoderPool } from '../stream/decoder_pool.ts';
import type { Counts } from '../stream/decode_messages.ts';
import type { DecodedFrame, FrameInfo } from '../stream/frame.ts';
import { Player, type PlayerEvents, type PlayerSettings } from '../stream/player.ts';
import { Effort } from './effort.ts';
import type { SubjectInfo } from './subject.ts';

export interface PictureEvents extends Omit<PlayerEvents, 'frame'> {
  /** A frame was drawn. */
  shown(info: FrameInfo): void;
}

/** The frame that is shown. */
export interface ShownFrame {
  info: FrameInfo;
  counts: Counts;
  numBytes: number;
  atMs: number;
}

const settleMs = 220;

export class Picture {
  readonly stage: Stage;
  player: Player | undefined;
  shown: ShownFrame | undefined;
  numShown = 0;
  numSkipped = 0; // decoded, but replaced before they were drawn
  orderViolations = 0;
  readonly shownRate = new Rate();
  readonly decodeMs = new Meter(120);
  readonly mainMs = new Meter();
  readonly bytesRate = new Meter(60);
  private info: SubjectInfo | undefined;
  private wantedOrbit: Orbit | undefined;
  private pending: DecodedFrame | undefined;
  private lastOrder = 0;
  private request = 0;
  private scheduledMs = 0;
  private dirty = true;
  private isStill = false;
  private settleTimer: ReturnType<typeof setTimeout> | undefined;
  private readonly effort = new Effort();
  private size: [number, number] = [1, 1];
  private appliedSize = '';

  constructor(
    canvas: HTMLCanvasElement,
    private readonly pool: DecoderPool,
    private readonly events: PictureEvents,
  ) {
    this.stage = new Stage(canvas);
    canvas.addEventListener('webglcontextrestored', () => this.draw());
  }

  /** Begins with another family or animation. */
  open(info: SubjectInfo, settings: PlayerSettings): Player {
    this.clear();
    this.info = info;
    this.stage.setWorld(info.box, info.rotation);
    this.player = new Player(this.pool, info.subject, info.timing, settings, {
      ...this.events,
      frame: (frame) => this.take(frame),
      changed: () => this.onChanged(),
    });
    this.player.limitLevel(this.effort.level);
    this.draw();
    return this.player;
  }

  /** Shows no liquid, and tells nothing more of what it showed. */
  clear(): void {
    const { player, pending } = this;
    this.player = this.pending = this.shown = undefined;
    this.lastOrder = 0;
    if (pending) this.pool.release(pending.buffers);
    player?.close();
    this.stage.surface.clear();
    this.draw();
  }

  get orbit(): Orbit {
    return this.wantedOrbit ?? fitted(this.stage.sphere, this.stage.aspect);
  }

  /** undefined: all in view. */
  setOrbit(orbit: Orbit | undefined): void {
    this.wantedOrbit = orbit;
    this.draw();
  }

  setLook(look: Look): void {
    this.stage.setLook(look);
    this.draw();
  }

  setSize(width: number, height: number): void {
    this.size = [Math.max(1, width), Math.max(1, height)];
    this.applySize();
    this.draw();
  }

  /** Whether the last picture is drawn as finely as it will be. */
  get settled(): boolean {
    return this.isStill && !this.dirty && !this.pending && !!this.shown;
  }

  get pixelRatio(): number {
    return this.effort.ratio(this.isStill);
  }

  get numWaiting(): number {
    return this.player?.numWaiting ?? 0;
  }

  /** The picture as PNG. */
  async toPng(): Promise<Blob> {
    this.stage.render(this.orbit, true);
    return new Promise((resolve, reject) => {
      this.stage.canvas.toBlob((blob) => {
        if (blob) resolve(blob);
        else reject(new Error('The picture cannot be made.'));
      }, 'image/png');
    });
  }

  close(): void {
    this.clear();
    cancelAnimationFrame(this.request);
    clearTimeout(this.settleTimer);
    this.stage.dispose();
  }

  private take(frame: DecodedFrame): void {
    if (this.pending) {
      ++this.numSkipped;
      this.pool.release(this.pending.buffers);
    }
    this.pending = frame;
    this.decodeMs.add(frame.decodeMs);
    this.draw();
  }

  private onChanged(): void {
    if (this.player?.playing) this.schedule();
    this.events.changed();
  }

  /** Draws again soon, quickly; and finely once nothing moves any more. */
  private draw(): void {
    this.dirty = true;
    this.moving();
    this.schedule();
  }

  private moving(): void {
    clearTimeout(this.settleTimer);
    this.settleTimer = setTimeout(() => this.settle(), settleMs);
    if (!this.isStill) return;
    this.isStill = false;
    this.applySize();
  }

  private settle(): void {
    if (this.player?.playing || this.pending) return;
    this.isStill = true;
    this.applySize();
    this.dirty = true;
    this.schedule();
  }

  private schedule(): void {
    if (this.request) return;
    this.scheduledMs = performance.now();
    this.request = requestAnimationFrame((now) => {
      this.request = 0;
      this.tick(now);
    });
  }

  private tick(nowMs: number): void {
    const { player } = this;
    player?.tick(nowMs);
    if (this.dirty && this.info && measured(() => this.paint(nowMs))) this.mainMs.add(takeSpent());
    if (player?.playing) this.schedule();
  }

  /** Returns whether it was another frame. */
  private paint(nowMs: number): boolean {
    this.dirty = false;
    const frame = this.pending;
    this.pending = undefined;
    if (frame) this.upload(frame, nowMs);
    const waitedMs = performance.now() - this.scheduledMs;
    if (!this.isStill && this.effort.measure(waitedMs)) this.applyEffort();
    this.stage.render(this.orbit, this.isStill);
    if (frame) this.events.shown(frame.info);
    return !!frame;
  }

  private upload(frame: DecodedFrame, nowMs: number): void {
    const { order, info, counts, numBytes } = frame;
    if (order <= this.lastOrder) ++this.orderViolations;
    this.lastOrder = order;
    this.stage.show(frame);
    this.pool.release(frame.buffers);
    this.shown = { info, counts, numBytes, atMs: performance.now() };
    ++this.numShown;
    this.shownRate.add(nowMs);
    this.bytesRate.add(numBytes);
  }

  private applyEffort(): void {
    this.player?.limitLevel(this.effort.level);
    this.applySize();
  }

  private applySize(): void {
    const size = [...this.size, this.pixelRatio] as [number, number, number];
    if (size.join() === this.appliedSize) return;
    this.appliedSize = size.join();
    this.stage.setSize(...size);
  }
}
