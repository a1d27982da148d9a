// Plays a family or an animation: decides what frame is asked for, and how.
import type { ApiError } from '../api/errors.ts';
import { advance, playedRange, shortTime, startTime, type Course, type Loop } from './clock.ts';
import type { DecoderPool } from './decoder_pool.ts';
import type { Wanted } from './decode_messages.ts';
import type { DecodedFrame } from './frame.ts';
import { isFamily, type Blend, type Subject } from './frame_request.ts';
import type { StreamRequest, StreamState } from './frame_stream.ts';
import { Live } from './live.ts';
import { Stills } from './stills.ts';
import { blendOf, paceOf, streamChange, surfaceOf } from './stream_changes.ts';

export interface PlayerSettings {
  blend: Blend;
  rate: number;
  loop: Loop;
  range: [number, number];
  framesPerSecond: number; // of the clock; 0: the family's own
  level: number | 'auto';
  wanted: Wanted;
}

/** When the frames of a subject are. */
export interface Timing {
  durationS: number;
  framesPerSecond: number;
  numLevels: number; // of detail
}

export interface PlayerEvents {
  /** To be shown and then released. */
  frame(frame: DecodedFrame): void;
  /** Time, playing or the connection changed. */
  changed(): void;
  error(error: ApiError | undefined): void;
}

export class Player {
  playing = false;
  timeS = 0;
  connection: StreamState = 'closed';
  numLate = 0; // decoded, but a newer one was there before
  private held = false;
  private order = 0;
  private shownOrder = 0;
  private wrapping = false;
  private lastTickMs = 0;
  private lastStill = '';
  private coarseness = 0;
  private readonly stills: Stills;
  private readonly live: Live;

  constructor(
    private readonly pool: DecoderPool,
    readonly subject: Subject,
    readonly timing: Timing,
    private settings: PlayerSettings,
    private readonly events: PlayerEvents,
  ) {
    const frame = (decoded: DecodedFrame) => this.deliver(decoded);
    const error = (failure: ApiError) => this.fail(failure);
    this.stills = new Stills(pool, { frame, error });
    this.live = new Live(pool, () => ++this.order, {
      frame,
      error,
      end: () => this.end(),
      state: (state) => this.setConnection(state),
    });
  }

  get numRunning(): number {
    return this.stills.numRunning;
  }

  get numWaiting(): number {
    return this.stills.numWaiting;
  }

  get mostWaiting(): number {
    return this.stills.mostWaiting;
  }

  get numReceived(): number {
    return this.live.numReceived;
  }

  get numOvertaken(): number {
    return this.live.numOvertaken;
  }

  get course(): Course {
    const { rate, loop, range } = this.settings;
    return { rate, loop, range, durationS: this.timing.durationS };
  }

  configure(settings: PlayerSettings): void {
    const before = this.settings;
    this.settings = settings;
    this.live.wanted = settings.wanted;
    if (!this.streams) return this.requestStill(false);
    const { framesPerSecond } = this.timing;
    const change = streamChange(before, settings, this.coarseness, framesPerSecond);
    if (change) this.live.change(change);
  }

  /** The finest level of detail that can be drawn fast enough, while it plays. */
  limitLevel(level: number): void {
    const before = this.surface;
    this.coarseness = Math.min(level, this.timing.numLevels - 1);
    const { surface } = this;
    if (this.streams && JSON.stringify(surface) !== JSON.stringify(before))
      this.live.change(surface);
  }

  play(): void {
    if (this.playing) return;
    this.playing = true;
    this.timeS = startTime(this.timeS, this.course);
    if (!this.held) this.begin();
    this.events.changed();
  }

  pause(): void {
    if (!this.playing) return;
    this.playing = false;
    this.stop();
    this.seek(this.timeS, true);
  }

  /** Shows a time. `last`: no other one follows at once, so requests before it are ended. */
  seek(timeS: number, last: boolean): void {
    this.timeS = shortTime(timeS, this.timing.durationS);
    if (this.streams) this.live.change({ timeS: this.timeS });
    else this.requestStill(last);
    this.events.changed();
  }

  /** Stands still while a person moves the thumb. */
  hold(): void {
    if (this.held) return;
    this.held = true;
    this.stop();
  }

  /** Goes on from where the thumb was left. */
  letGo(): void {
    if (!this.held) return;
    this.held = false;
    if (this.playing) this.begin();
    else this.requestStill(true);
  }

  /** Moves an animation's own clock on; families have the stream's. */
  tick(nowMs: number): void {
    const elapsedS = (nowMs - this.lastTickMs) / 1000;
    this.lastTickMs = nowMs;
    if (!this.playing || this.held || isFamily(this.subject)) return;
    const step = advance(this.timeS, Math.min(elapsedS, 1), this.course);
    this.timeS = step.timeS;
    this.requestStill(false);
    if (step.ended) this.end();
    else this.events.changed();
  }

  close(): void {
    this.playing = false;
    this.stop();
  }

  private get streams(): boolean {
    return this.playing && !this.held && isFamily(this.subject);
  }

  private begin(): void {
    this.stills.cancel();
    this.lastStill = '';
    this.lastTickMs = performance.now();
    if (isFamily(this.subject)) this.live.open(this.firstRequest());
  }

  private stop(): void {
    this.stills.cancel();
    this.lastStill = '';
    this.live.close();
  }

  private end(): void {
    this.playing = false;
    const [low, high] = playedRange(this.course);
    this.seek(this.settings.rate < 0 ? low : high, true);
  }

  private firstRequest(): StreamRequest {
    const { subject, timeS, settings } = this;
    this.wrapping = false;
    this.live.wanted = settings.wanted;
    return {
      family: subject.name,
      version: subject.version,
      timeS,
      rate: settings.rate,
      loop: settings.loop !== 'off',
      ...paceOf(settings),
      ...blendOf(settings.blend),
      ...this.surface,
    };
  }

  private get surface(): StreamRequest {
    return surfaceOf(this.settings, this.coarseness);
  }

  private requestStill(last: boolean): void {
    const { subject, settings } = this;
    const family = isFamily(subject);
    const levelOfDetail = family && settings.level !== 'auto' ? settings.level : 0;
    const { blend, wanted } = settings;
    const { restPositions } = wanted;
    const timeS = this.stillTime();
    const request = { subject, blend, timeS, levelOfDetail, restPositions, wanted };
    const key = JSON.stringify({ ...request, subject: subject.name });
    if (key !== this.lastStill) {
      this.lastStill = key;
      this.stills.request(++this.order, request);
    }
    if (last) this.stills.hurry();
  }

  // An animation has only its own frames.
  private stillTime(): number {
    const { framesPerSecond, durationS } = this.timing;
    if (isFamily(this.subject)) return shortTime(this.timeS, durationS);
    const frame = Math.round(this.timeS * framesPerSecond);
    return Math.min(durationS, frame / framesPerSecond);
  }

  private deliver(frame: DecodedFrame): void {
    if (frame.order <= this.shownOrder || (this.streams && this.isBeyond(frame.info.timeS))) {
      ++this.numLate;
      this.pool.release(frame.buffers);
      return;
    }
    this.shownOrder = frame.order;
    if (this.streams) this.timeS = shortTime(frame.info.timeS, this.timing.durationS);
    this.events.error(undefined);
    this.events.frame(frame);
  }

  // Frames beyond the range that is looped; the first of them sends the stream back.
  private isBeyond(timeS: number): boolean {
    const { course } = this;
    if (course.loop !== 'range') return false;
    const [low, high] = playedRange(course);
    if (timeS >= low - 1e-6 && timeS <= high + 1e-6) {
      this.wrapping = false;
      return false;
    }
    if (!this.wrapping) this.live.change({ timeS: course.rate < 0 ? high : low });
    this.wrapping = true;
    return true;
  }

  private fail(error: ApiError): void {
    this.lastStill = '';
    if (this.playing) {
      this.playing = false;
      this.stop();
    }
    this.events.error(error);
    this.events.changed();
  }

  private setConnection(state: StreamState): void {
    this.connection = state;
    this.events.changed();
  }
}
