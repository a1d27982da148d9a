// Workers that decode Draco, and the buffers that go to them and back.
import wasmUrl from 'draco3d/draco_decoder.wasm?url';
import { measured } from '../base/work.ts';
import { BufferPool, transferables, type FrameBuffers } from './buffers.ts';
import type { Counts, Decoded, DecodeJob, SetUp, Wanted } from './decode_messages.ts';

export interface DecodeResult {
  counts: Counts;
  buffers: FrameBuffers;
  decodeMs: number;
}

interface Job {
  id: number;
  data: Uint8Array<ArrayBuffer>;
  wanted: Wanted;
  resolve: (result: DecodeResult) => void;
  reject: (error: Error) => void;
}

interface Crew {
  worker: Worker;
  job: Job | undefined;
  numDecoded: number;
}

const noWorkers = 'No decoding worker runs in this browser.';

async function compile(): Promise<WebAssembly.Module> {
  const response = await fetch(wasmUrl);
  if (!response.ok) throw new Error(`The decoder cannot be fetched (status ${response.status}).`);
  const type = response.headers.get('Content-Type') ?? '';
  if (type.startsWith('application/wasm')) return WebAssembly.compileStreaming(response);
  return WebAssembly.compile(await response.arrayBuffer());
}

function startWorker(): Worker {
  return new Worker(new URL('./decode_worker.ts', import.meta.url), { type: 'module' });
}

/** At least two, so that one frame is decoded while another one is on its way. */
function defaultSize(): number {
  return Math.min(4, Math.max(2, navigator.hardwareConcurrency - 1));
}

/** Decodes frames off the main thread; one pool serves the whole page. */
export class DecoderPool {
  readonly buffers = new BufferPool();
  numDecoded = 0;
  private readonly module = compile();
  private readonly crews: Crew[] = [];
  private readonly waiting: Job[] = [];
  private lastId = 0;

  constructor(readonly size = defaultSize()) {
    this.module.catch(() => {});  // told to each job
    for (let i = 0; i < size; ++i) this.crews.push(this.start());
  }

  get numInFlight(): number {
    return this.waiting.length + this.crews.filter((crew) => crew.job).length;
  }

  /** Takes `data`: it is moved to a worker. Errors: rejects for data that is no mesh. */
  decode(data: Uint8Array<ArrayBuffer>, wanted: Wanted): Promise<DecodeResult> {
    if (!this.crews.length) return Promise.reject(new Error(noWorkers));
    return new Promise((resolve, reject) => {
      this.waiting.push({ id: ++this.lastId, data, wanted, resolve, reject });
      this.assign();
    });
  }

  release(buffers: FrameBuffers): void {
    this.buffers.give(buffers);
  }

  private start(): Crew {
    const crew: Crew = { worker: startWorker(), job: undefined, numDecoded: 0 };
    crew.worker.onmessage = ({ data }: MessageEvent<Decoded>) =>
      measured(() => this.finish(crew, data));
    crew.worker.onerror = (event) => this.replace(crew, event.message);
    void this.module.then(
      (module) => crew.worker.postMessage({ kind: 'setUp', module } satisfies SetUp),
      (error: unknown) => this.fail(crew, String(error)),
    );
    return crew;
  }

  private assign(): void {
    for (const crew of this.crews) {
      if (crew.job) continue;
      const job = this.waiting.shift();
      if (!job) return;
      void this.give(crew, job);
    }
  }

  private async give(crew: Crew, job: Job): Promise<void> {
    crew.job = job;
    try {
      await this.module;
    } catch (error) {
      return this.fail(crew, String(error));
    }
    const { id, data, wanted } = job;
    const message: DecodeJob = { kind: 'decode', id, data, wanted, buffers: this.buffers.take() };
    crew.worker.postMessage(message, [data.buffer, ...transferables(message.buffers)]);
  }

  private finish(crew: Crew, decoded: Decoded): void {
    const { job } = crew;
    crew.job = undefined;
    const { buffers, counts, decodeMs } = decoded;
    if (job && counts) {
      ++this.numDecoded;
      ++crew.numDecoded;
      job.resolve({ counts, buffers, decodeMs });
    } else {
      this.release(buffers);
      job?.reject(new Error(decoded.error ?? 'The frame cannot be decoded.'));
    }
    this.assign();
  }

  private fail(crew: Crew, message: string): void {
    const { job } = crew;
    crew.job = undefined;
    job?.reject(new Error(message));
    this.assign();
  }

  // A worker that died takes its job and buffers with it. One that never worked is not tried again.
  private replace(crew: Crew, message: string): void {
    crew.worker.terminate();
    crew.job?.reject(new Error(message || 'A decoding worker died.'));
    this.crews.splice(this.crews.indexOf(crew), 1);
    if (crew.numDecoded) this.crews.push(this.start());
    if (!this.crews.length) this.giveUp();
    this.assign();
  }

  private giveUp(): void {
    for (const job of this.waiting.splice(0)) job.reject(new Error(noWorkers));
  }
}

let shared: DecoderPool | undefined;

/** The pool of the whole page: its workers live as long as the page. */
export function sharedPool(): DecoderPool {
  shared ??= new DecoderPool();
  return shared;
}
