import assert from 'node:assert/strict';
import { test } from 'node:test';
import { create, fromBinary, toBinary } from '@bufbuild/protobuf';
import {
  StreamFramesRequestSchema,
  StreamFramesResponseSchema,
} from '../src/generated/liquidblend/v1/liquidblend_pb.ts';
import { BackOff } from '../src/stream/back_off.ts';
import { BufferPool, emptyBuffers, grownFloats } from '../src/stream/buffers.ts';
import { advance, playedRange, shortTime, startTime, type Course } from '../src/stream/clock.ts';
import { frameFileName, frameTimes } from '../src/stream/export.ts';
import { framePath } from '../src/stream/frame_request.ts';
import { FrameStream } from '../src/stream/frame_stream.ts';
import { NewestWins } from '../src/stream/newest_wins.ts';
import { writeEdges, writeNormals } from '../src/stream/normals.ts';
import type { PlayerSettings } from '../src/stream/player.ts';
import { streamChange } from '../src/stream/stream_changes.ts';

const course: Course = { rate: 1, loop: 'off', range: [0.5, 1], durationS: 2 };

/** Requests that end when the test says so. */
function manual() {
  const runs: { request: number; signal: AbortSignal; finish: () => void }[] = [];
  const queue = new NewestWins<number>(
    (request, signal) =>
      new Promise((resolve) => {
        signal.addEventListener('abort', () => resolve());
        runs.push({ request, signal, finish: resolve });
      }),
  );
  return { queue, runs };
}

const settled = () => new Promise((resolve) => setImmediate(resolve));

test('NewestWinsRunsTheFirstAndThenTheLast', async () => {
  const { queue, runs } = manual();
  for (let request = 0; request < 200; ++request) queue.push(request);
  assert.equal(queue.numRunning, 1);
  assert.equal(queue.numWaiting, 1);
  runs[0]!.finish();
  await settled();
  assert.deepEqual(
    runs.map((run) => run.request),
    [0, 199],
  );
  assert.equal(queue.numWaiting, 0);
  assert.equal(queue.mostWaiting, 1);
});

test('NewestWinsInAHurryEndsTheOneThatRuns', async () => {
  const { queue, runs } = manual();
  queue.push(1);
  queue.hurry();
  assert.equal(runs[0]!.signal.aborted, false, 'nothing waits: it goes on');
  queue.push(2);
  queue.hurry();
  await settled();
  assert.equal(runs[0]!.signal.aborted, true);
  assert.deepEqual(
    runs.map((run) => run.request),
    [1, 2],
  );
  runs[1]!.finish();
  await settled();
  assert.equal(queue.numRunning, 0);
});

test('NewestWinsForgetsAllWhenCancelled', async () => {
  const { queue, runs } = manual();
  queue.push(1);
  queue.push(2);
  queue.cancel();
  await settled();
  assert.equal(runs.length, 1);
  assert.equal(queue.numRunning + queue.numWaiting, 0);
  queue.push(3);
  assert.equal(runs.length, 2);
});

test('BuffersAreUsedAgain', () => {
  const pool = new BufferPool(2);
  const first = pool.take();
  pool.give(first);
  assert.equal(pool.take(), first);
  assert.equal(pool.numMade, 1);
  for (let i = 0; i < 5; ++i) pool.give(emptyBuffers());
  const taken = new Set([pool.take(), pool.take(), pool.take()]);
  assert.equal(pool.numMade, 2, 'two were kept, the third is new');
  assert.equal(taken.size, 3);
});

test('BuffersGrowAndNeverShrink', () => {
  const small = grownFloats(new Float32Array(0), 100);
  assert.ok(small.length >= 100);
  assert.equal(grownFloats(small, 50), small);
  assert.notEqual(grownFloats(small, 1000), small);
});

test('ClockEndsOrWraps', () => {
  assert.deepEqual(advance(1.9, 0.2, course), { timeS: 2, ended: true });
  const whole = advance(1.9, 0.2, { ...course, loop: 'whole' });
  assert.ok(Math.abs(whole.timeS - 0.1) < 1e-9 && !whole.ended);
  const range = advance(0.9, 0.2, { ...course, loop: 'range' });
  assert.ok(Math.abs(range.timeS - 0.6) < 1e-9 && !range.ended);
  const back = advance(0.6, 0.2, { ...course, loop: 'range', rate: -1 });
  assert.ok(Math.abs(back.timeS - 0.9) < 1e-9);
});

test('ClockTakesAnEmptyRangeAsAll', () => {
  assert.deepEqual(playedRange({ ...course, loop: 'range', range: [1, 1] }), [0, 2]);
  assert.deepEqual(playedRange({ ...course, loop: 'range', range: [1.5, 0.5] }), [0.5, 1.5]);
  assert.equal(advance(0, 5, { ...course, durationS: 0, loop: 'whole' }).timeS, 0);
});

test('PlayingBeginsAnewAtTheEnd', () => {
  assert.equal(startTime(2, course), 0);
  assert.equal(startTime(2.9583, { ...course, durationS: 71 / 24 }), 0, 'as rounded');
  assert.equal(startTime(0.7, course), 0.7);
  assert.equal(startTime(1.7, { ...course, loop: 'range' }), 0.5);
  assert.equal(startTime(0, { ...course, rate: -1 }), 2);
});

test('BackOffDoublesUpToItsLimit', () => {
  const backOff = new BackOff(100, 1000, () => 0.5);
  assert.deepEqual(
    [1, 2, 3, 4, 5, 6].map(() => backOff.next()),
    [100, 200, 400, 800, 1000, 1000],
  );
  backOff.reset();
  assert.equal(backOff.next(), 100);
});

/** A socket without a network, of which the test is the server. */
class FakeSocket {
  static readonly OPEN = 1;
  static all: FakeSocket[] = [];
  readyState = 0;
  requests: { timeS?: number; credit?: number }[] = [];
  onopen = () => {};
  onmessage = (_event: { data: ArrayBuffer }) => {};
  onclose = (_event: { code: number; reason: string }) => {};

  constructor() {
    FakeSocket.all.push(this);
  }

  send(bytes: Uint8Array): void {
    this.requests.push(fromBinary(StreamFramesRequestSchema, bytes));
  }

  close(): void {}

  accept(): void {
    this.readyState = FakeSocket.OPEN;
    this.onopen();
  }

  give(timeS: number, nextTimeS: number): void {
    const frame = { timeS, data: new Uint8Array(1) };
    const response = create(StreamFramesResponseSchema, { frame, nextTimeS });
    this.onmessage({ data: toBinary(StreamFramesResponseSchema, response).buffer as ArrayBuffer });
  }
}

test('AStreamWhoseServerStopsGoesOnAtOnceWithTheNextFrame', () => {
  Object.assign(globalThis, { WebSocket: FakeSocket, location: { protocol: 'http:', host: 'x' } });
  const times: number[] = [];
  const states: string[] = [];
  const stream = new FrameStream(
    {
      frame: ({ info }) => times.push(info.timeS),
      end: () => assert.fail('ended'),
      error: (error) => assert.fail(error.message),
      state: (state) => states.push(state),
      probe: () => Promise.resolve(),
    },
    4,
  );
  stream.open({ family: 'families/drops', timeS: 0 });
  const [first] = FakeSocket.all;
  first!.accept();
  first!.give(0, 0.25);
  first!.give(0.25, 0.5);
  first!.onclose({ code: 1001, reason: 'the server is shutting down' });
  const [, second] = FakeSocket.all;
  assert.ok(second, 'no pause before it');
  second.accept();
  assert.equal(second.requests[0]!.timeS, 0.5);
  assert.equal(second.requests[0]!.credit, 4);
  second.give(0.5, 0.75);
  assert.deepEqual(times, [0, 0.25, 0.5]);
  assert.ok(!states.includes('waiting'));
  stream.close();
});

test('NormalsPointOutwardsAndEdgesComeOnce', () => {
  const positions = new Float32Array([0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1]);
  const triangles = new Uint32Array([0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3]);
  const normals = new Float32Array(12);
  writeNormals(positions, triangles, 4, 4, normals);
  assert.ok(normals[0]! < 0 && normals[1]! < 0 && normals[2]! < 0);
  assert.ok(Math.abs(Math.hypot(normals[3]!, normals[4]!, normals[5]!) - 1) < 1e-6);
  const edges = new Uint32Array(12);
  assert.equal(writeEdges(triangles, 4, edges), 6);
  const names = new Set(Array.from({ length: 6 }, (_, i) => `${edges[2 * i]}-${edges[2 * i + 1]}`));
  assert.equal(names.size, 6);
});

test('FramePathsHaveOnlyWhatIsSet', () => {
  const family = { name: 'families/two drops', version: 0n };
  const request = { subject: family, blend: { weights: [0.5, 1] }, timeS: 0.8, levelOfDetail: 0 };
  assert.equal(
    framePath(request, 'drc'),
    '/v1/families/two%20drops/frame.drc?weights=0.5%2C1&time=0.8',
  );
  const parameters = [{ name: 'width', value: 2 }];
  const point = { ...request, blend: { weights: [], parameters, extrapolate: true } };
  assert.match(framePath(point, 'ply'), /parameters=width%3D2&extrapolate=true&time=0.8$/);
  const animation = { ...request, subject: { name: 'animations/a', version: 0n } };
  assert.equal(framePath(animation, 'obj'), '/v1/animations/a/frame.obj?timeS=0.8');
});

test('ExportsHaveEachFrameOnce', () => {
  const times = frameTimes({ durationS: 71 / 24, framesPerSecond: 24, numLevels: 1 });
  assert.equal(times.length, 72);
  assert.equal(times.at(-1), 71 / 24);
  assert.equal(frameFileName(0, 'ply'), 'frame_0001.ply');
});

// 101 frames at 24 a second: the end rounds up.
test('RoundedTimesAreNeverBeyondTheEnd', () => {
  assert.equal(shortTime(100 / 24, 100 / 24), 100 / 24);
  assert.equal(shortTime(9, 100 / 24), 100 / 24);
  assert.equal(shortTime(1.23456, 100 / 24), 1.2346);
  assert.equal(shortTime(-1, 2), 0);
});

test('AStreamIsToldOnlyWhatChanged', () => {
  const settings = (restPositions: boolean, rate = 1): PlayerSettings => ({
    blend: { weights: [0.5] },
    rate,
    loop: 'off',
    range: [0, 0],
    framesPerSecond: 60,
    level: 1,
    wanted: { normals: true, velocities: false, restPositions, edges: false },
  });
  const attributes = (change: ReturnType<typeof streamChange>) => change?.surface?.attributes;
  assert.equal(streamChange(settings(false), settings(false), 0, 24), undefined);
  assert.deepEqual(streamChange(settings(true), settings(true, 2), 0, 24), { rate: 2 });
  assert.equal(attributes(streamChange(settings(false), settings(true), 0, 24))?.length, 1);
  assert.deepEqual(attributes(streamChange(settings(true), settings(false), 0, 24)), []);
});
