import assert from 'node:assert/strict';
import { test } from 'node:test';
import { HashLocation, formatHash, parseHash } from '../src/base/hash_location.ts';
import { fromFields, initialState, toFields, type ViewState } from '../src/view/state.ts';

function through(state: ViewState): ViewState {
  const hash = formatHash({ section: 'view', fields: toFields(state) });
  return fromFields(parseHash(hash).fields);
}

const everything: ViewState = {
  name: 'families/two_drops',
  version: 12n,
  weights: [0.5, -0.25, 1.333333],
  point: [0.8, 35],
  extrapolate: true,
  playing: true,
  rate: 0.25,
  loop: 'range',
  range: [0.5, 1.25],
  framesPerSecond: 24,
  level: 2,
  shading: 'plain',
  wireframe: true,
  pattern: true,
  theme: 'dark',
  beside: ['source', 'target.2', 'version.11'],
  oneCamera: false,
  oneTime: false,
  panes: [0.1, 0.2, 0.3, 0.4].map((timeS, index) => ({
    timeS,
    orbit: { azimuth: 350.25, elevation: -20.5, distance: 5.12345, target: [index, 0.1234, -2] },
  })),
};

test('StateInTheUrlComesBackWhole', () => {
  assert.deepEqual(through(everything), everything);
});

test('UsualStateLeavesAnEmptyUrl', () => {
  assert.equal(toFields(initialState()).toString(), '');
  assert.deepEqual(through(initialState()), initialState());
});

test('CoupledPanesShareOneCameraAndTime', () => {
  const panes = [{ timeS: 1.5, orbit: undefined }];
  const state: ViewState = { ...everything, oneCamera: true, oneTime: true, panes };
  assert.deepEqual(through(state), state);
});

test('NonsenseInTheUrlIsAsUsual', () => {
  const { fields } = parseHash(
    '#view?family=f&rate=x&loop=never&level=99&w=1e999,5&cam=1,2&version=-1&beside=source,evil,source&t=NaN',
  );
  const state = fromFields(fields);
  assert.equal(state.rate, 1);
  assert.equal(state.loop, 'whole');
  assert.equal(state.level, 'auto');
  assert.deepEqual(state.weights, [2]);
  assert.equal(state.panes[0]!.orbit, undefined);
  assert.equal(state.panes[0]!.timeS, 0);
  assert.equal(state.version, 0n);
  assert.deepEqual(state.beside, ['source']);
});

test('HashKeepsCommasReadable', () => {
  const fields = new URLSearchParams({ w: '0.5,1', family: 'a&b=c' });
  const hash = formatHash({ section: 'view', fields });
  assert.equal(hash, '#view?w=0.5,1&family=a%26b%3Dc');
  assert.equal(parseHash(hash).fields.get('family'), 'a&b=c');
});

// A window with a history of which only the newest place is looked at.
function fakeWindow(hash: string) {
  const listeners = new Map<string, () => void>();
  const target = {
    location: { hash },
    history: {
      pushState: (_: unknown, __: string, url: string) => (target.location.hash = url),
      replaceState: (_: unknown, __: string, url: string) => (target.location.hash = url),
    },
    addEventListener: (name: string, listener: () => void) => listeners.set(name, listener),
    setTimeout: () => 1,
    clearTimeout: () => {},
    tell: (name: string) => listeners.get(name)?.(),
  };
  return target;
}

function placeOf(id: string) {
  return { section: 'view', fields: new URLSearchParams({ family: id }) };
}

test('WhatWaitsIsNotWrittenOverAnotherPlace', () => {
  const target = fakeWindow('#view?family=a');
  const location = new HashLocation(target as unknown as Window);
  location.replace(placeOf('a1'));
  location.flush();
  assert.equal(target.location.hash, '#view?family=a1');
  assert.equal(location.value.fields.get('family'), 'a1', 'what was written is the place now');
  location.replace(placeOf('a2'));
  target.location.hash = '#view?family=b';  // its event comes later
  location.flush();
  assert.equal(target.location.hash, '#view?family=b');
  target.tell('hashchange');
  assert.equal(location.value.fields.get('family'), 'b');
});
