import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { dirname, join } from 'node:path';
import { test } from 'node:test';
import { fileURLToPath } from 'node:url';
import { PairDocument } from '../src/pairs/document.ts';
import { History } from '../src/pairs/history.ts';
import { meanResidual } from '../src/pairs/measure.ts';
import { numberText } from '../src/pairs/number_text.ts';
import { formatPairs, parsePairs, withoutComments } from '../src/pairs/pair_file.ts';
import { PairFiles } from '../src/pairs/pair_files.ts';
import {
  addPlace,
  checkPairs,
  deletePair,
  emptyList,
  isWhole,
  openPair,
  patchPair,
  sentPairs,
  type Habit,
  type PairList,
  type Side,
} from '../src/pairs/pairs.ts';
import { againRequest } from '../src/pairs/registration.ts';
import { startList } from '../src/pairs/store.ts';
import { place } from './places.ts';

const habit: Habit = { kind: 'POINT', hard: false, check: false };
const root = join(dirname(fileURLToPath(import.meta.url)), '../../../..');

function click(list: PairList, side: Side, x: number): PairList {
  return addPlace(list, side, place(x), habit);
}

function withPairs(count: number): PairList {
  let list = emptyList;
  for (let i = 0; i < count; ++i) list = click(click(list, 'source', i), 'target', i + 0.5);
  return list;
}

test('ClicksAddSourceAndTargetInTurn', () => {
  let list = click(emptyList, 'source', 1);
  assert.equal(openPair(list)?.number, 1);
  list = click(list, 'source', 2);
  assert.equal(list.pairs.length, 1, 'a second click in the source moves the place');
  list = click(list, 'target', 3);
  assert.ok(isWhole(list.pairs[0]!));
  assert.equal(openPair(list), undefined);
  list = click(list, 'target', 4);
  list = click(list, 'source', 5);
  assert.deepEqual(
    list.pairs.map(({ number }) => number),
    [1, 2],
  );
  assert.equal(list.pairs[1]!.source!.position[0], 5);
});

test('DeletionKeepsTheNumbersOfTheOthers', () => {
  let list = deletePair(withPairs(5), 3);
  assert.deepEqual(
    list.pairs.map(({ number }) => number),
    [1, 2, 4, 5],
  );
  list = click(list, 'source', 9);
  assert.deepEqual(
    list.pairs.map(({ number }) => number),
    [1, 2, 4, 5, 6],
    'no number comes again',
  );
  assert.equal(click(deletePair(withPairs(2), 2), 'source', 1).pairs[1]!.number, 3);
});

test('FiftyStepsAreUndoneAndDoneAgain', () => {
  const history = new History(emptyList);
  const states = [history.value];
  for (let i = 0; i < 60; ++i) {
    history.push(click(history.value, i % 2 ? 'target' : 'source', i));
    states.push(history.value);
  }
  for (let i = 59; i >= 0; --i) {
    history.undo();
    assert.equal(history.value, states[i]);
  }
  assert.equal(history.canUndo, false);
  history.undo();
  for (let i = 1; i <= 60; ++i) {
    history.redo();
    assert.equal(history.value, states[i]);
  }
  assert.equal(history.canRedo, false);
});

test('AChangeAfterUndoForgetsWhatWasUndone', () => {
  const history = new History(0);
  history.push(1);
  history.undo();
  history.push(2);
  assert.equal(history.canRedo, false);
  history.undo();
  assert.equal(history.value, 0);
});

test('TheOldestStepsAreForgotten', () => {
  const history = new History(0, 3);
  for (const value of [1, 2, 3, 4, 5]) history.push(value);
  for (let i = 0; i < 9; ++i) history.undo();
  assert.equal(history.value, 2);
});

test('CheckPairsAndThoseSwitchedOffAreNotSent', () => {
  let list = withPairs(4);
  list = patchPair(list, 2, { check: true });
  list = patchPair(list, 3, { enabled: false });
  list = click(list, 'source', 7);
  assert.deepEqual(
    sentPairs(list).map(({ number }) => number),
    [1, 4],
  );
  assert.deepEqual(
    checkPairs(list).map(({ number }) => number),
    [2],
  );
});

test('NumbersAreWrittenAsByTheCommandLine', () => {
  const texts: [number, string][] = [
    [0, '0.0'],
    [-0, '-0.0'],
    [1, '1.0'],
    [-3, '-3.0'],
    [0.1, '0.1'],
    [1 / 3, '0.3333333333333333'],
    [2.5, '2.5'],
    [0.0001, '0.0001'],
    [0.00001, '1e-05'],
    [-2e-9, '-2e-09'],
    [1.25e-7, '1.25e-07'],
    [123456789012345, '123456789012345.0'],
    [1e15, '1e+15'],
    [1.5e15, '1.5e+15'],
    [1e22, '1e+22'],
    [1.7976931348623157e308, '1.7976931348623157e+308'],
    [5e-324, '5e-324'],
    [-1.0018967350255332, '-1.0018967350255332'],
  ];
  for (const [value, text] of texts) {
    assert.equal(numberText(value), text);
    assert.equal(Number(text), value);
  }
});

// A file that `liquidblend inspect --correspondences-json` wrote.
const written = `{"correspondences": [
  [
    {"kind":"space","hard":false,"source":{"position":[0.1,-2e-09,3.0],"time_s":0.3333333333333333},"target":{"position":[0.0,0.0,0.0],"time_s":0.7},"length_s":0.25},
    {"kind":"point","hard":true,"source":{"position":[1.0,2.0,-1.0018967350255332],"time_s":0.0},"target":{"position":[1e-05,0.0,0.0],"time_s":1.0},"length_s":0.0}],
  []]}
`;

test('WhatTheCommandLineWritesIsWrittenTheSame', () => {
  assert.equal(formatPairs(parsePairs(written, 'c.json')), written);
  assert.equal(formatPairs([[]]), '{"correspondences": [\n  []]}\n');
});

/** The blocks of JSON in a page that have correspondences. */
function blocksOf(page: string): string[] {
  const text = readFileSync(join(root, page), 'utf8');
  return [...text.matchAll(/```(?:json|text)[^\n]*\n([^]*?)```/g)]
    .map(([, block]) => block!)
    .filter((block) => block.startsWith('{"correspondences"'));
}

test('FilesComeBackByteForByteWhereNothingWasChanged', () => {
  const blocks = [...blocksOf('docs/correspondences.md'), written];
  assert.ok(blocks.length >= 3);
  for (const text of blocks) {
    const files = new PairFiles();
    const lists = files.read(
      text,
      'pairs.json',
      false,
      parsePairs(text, 'x').map(() => emptyList),
    );
    assert.equal(files.write(lists, false), text);
    const changed = lists.map((list) => patchPair(list, 1, { hard: !list.pairs[0]?.hard }));
    const again = files.write(changed, false);
    assert.notEqual(again, text);
    assert.deepEqual(
      parsePairs(again, 'x').map((list) => list.length),
      lists.map(({ pairs }) => pairs.length),
    );
    const back = changed.map((list) => patchPair(list, 1, { hard: !list.pairs[0]?.hard }));
    assert.equal(files.write(back, false), text, 'changed back');
  }
});

test('CheckPairsHaveAFileOfTheirOwn', () => {
  const files = new PairFiles();
  const lists = files.read(written, 'checks.json', true, [withPairs(2), emptyList]);
  assert.deepEqual(
    lists[0]!.pairs.map(({ number, check }) => [number, check]),
    [
      [1, false],
      [2, false],
      [3, true],
      [4, true],
    ],
  );
  assert.equal(files.write(lists, true), written);
  assert.equal(parsePairs(files.write(lists, false), 'x')[0]!.length, 2);
});

test('CommentsAreLeftOut', () => {
  const text = '{"a//": "/* no */", // yes\n "b": /* yes\n */ 1}';
  assert.deepEqual(JSON.parse(withoutComments(text)), { 'a//': '/* no */', b: 1 });
});

test('EveryMistakeHasItsPlace', () => {
  const event = '{"position": [0, 0, 0], "time_s": 0}';
  const refusal = (entry: string) => () =>
    parsePairs(`{"correspondences": [[${entry}]]}`, 'c.json');
  assert.throws(() => parsePairs('{', 'c.json'), /c\.json: is not JSON/);
  assert.throws(() => parsePairs('[]', 'c.json'), /is not an object/);
  assert.throws(
    () => parsePairs('{"correspondences": [7]}', 'c.json'),
    /correspondences\[0\]: is not a list/,
  );
  assert.throws(refusal('7'), /correspondences\[0\]\[0\]: is not an object/);
  assert.throws(refusal('{"sauce": 1}'), /unknown key "sauce"/);
  assert.throws(
    refusal(`{"kind": "line", "source": ${event}, "target": ${event}}`),
    /\[0\]\[0\]\.kind: "line"/,
  );
  assert.throws(
    refusal(`{"kind": "toString", "source": ${event}, "target": ${event}}`),
    /"toString" is not point/,
  );
  assert.throws(refusal(`{"source": ${event}}`), /\[0\]\[0\]\.target: is missing/);
  assert.throws(refusal('{"hard": 1}'), /\[0\]\[0\]\.hard/);
  assert.throws(
    refusal('{"source": {"position": [0, 0], "time_s": 0}}'),
    /\[0\]\[0\]\.source\.position/,
  );
  assert.throws(
    refusal('{"source": {"position": [0, 0, "z"], "time_s": 0}}'),
    /position\[2\]: is not a number/,
  );
  assert.throws(refusal('{"source": {"position": [0, 0, 0]}}'), /source\.time_s/);
});

test('AFileNeedsAListForEachTarget', () => {
  assert.throws(
    () => new PairFiles().read(written, 'c.json', false, [emptyList]),
    /2 lists, but the family has 1/,
  );
});

test('MeansAreOfAllResiduals', () => {
  assert.equal(meanResidual([]), undefined);
  const mean = meanResidual([
    { metres: 1, frames: 0 },
    { metres: 3, frames: 1 },
  ]);
  assert.deepEqual(mean, { metres: 2, frames: 0.5 });
});

const family = {
  name: 'families/f',
  version: 3n,
  source: 'animations/a',
  targets: ['animations/b'],
  reports: [
    {
      correspondences: [
        { automatic: true, confidence: 0.9, correspondence: { kind: 1, source: {}, target: {} } },
        {
          automatic: true,
          confidence: 0.8,
          correspondence: { kind: 1, source: { timeS: 1 }, target: {} },
        },
      ],
    },
  ],
} as unknown as Parameters<typeof againRequest>[0];
const again = { fromScratch: false, iterations: 0, findPairs: true };

test('RefiningSendsTheUsersPairsAlone', () => {
  const list = patchPair(withPairs(3), 2, { check: true });
  const request = againRequest(family, [list], again) as {
    refine: boolean;
    correspondences: { correspondences: unknown[] }[];
    options: { automaticCorrespondences: boolean };
  };
  assert.equal(request.refine, true);
  assert.equal(request.correspondences[0]!.correspondences.length, 2);
  assert.equal(request.options.automaticCorrespondences, true);
  assert.deepEqual(request.correspondences[0]!.correspondences[0], {
    kind: 'POINT',
    hard: false,
    source: { position: { x: 0, y: 0.5, z: -1 }, timeS: 0 },
    target: { position: { x: 0.5, y: 0.5, z: -1 }, timeS: 0 },
  });
});

test('WhereOneIsDroppedTheOthersAreSent', () => {
  const key = JSON.stringify(['POINT', [0, 0, 0], 1, [0, 0, 0], 0]);
  const list = { ...withPairs(1), dropped: [key] };
  const request = againRequest(family, [list], again) as {
    correspondences: { correspondences: unknown[] }[];
    options: { automaticCorrespondences: boolean };
  };
  assert.equal(request.correspondences[0]!.correspondences.length, 2);
  assert.equal(request.options.automaticCorrespondences, false);
});

test('WhereOneIsDroppedThoseOfOtherTargetsAreSentToo', () => {
  const two = {
    ...family,
    targets: ['animations/b', 'animations/c'],
    reports: [family.reports[0]!, family.reports[0]!],
  };
  const key = JSON.stringify(['POINT', [0, 0, 0], 1, [0, 0, 0], 0]);
  const request = againRequest(two, [{ ...emptyList, dropped: [key] }, emptyList], again) as {
    correspondences: { correspondences: unknown[] }[];
  };
  assert.deepEqual(
    request.correspondences.map(({ correspondences }) => correspondences.length),
    [1, 2],
  );
});

test('ANewVersionKeepsWhatWasMarkedAndAddsItsOtherPairs', () => {
  const stored = patchPair(withPairs(3), 2, { check: true });
  const own = sentPairs(withPairs(2));
  const list = startList(own, stored);
  assert.deepEqual(
    list.pairs.map(({ number, check }) => [number, check]),
    [
      [1, false],
      [2, true],
      [3, false],
      [4, false],
    ],
  );
  assert.equal(list.nextNumber, 5);
  assert.equal(startList(own, undefined).nextNumber, 3);
  const open = addPlace(patchPair(withPairs(2), 2, { enabled: false }), 'source', place(9), habit);
  assert.deepEqual(startList(own, open), open, 'pairs that are off, or half, stay as they are');
  const rounded = own.map((pair) => ({ ...pair, source: { ...pair.source, timeS: 1e-6 } }));
  assert.deepEqual(startList(rounded, stored).pairs.length, 4, 'registrations round');
});

test('AfterARegistrationNoStateHasDroppedPairs', () => {
  const key = JSON.stringify(['POINT', [0, 0, 0], 1, [0, 0, 0], 0]);
  const pairs = new PairDocument(() => {});
  pairs.begin(family);
  pairs.addPlace('source', place(1), habit);
  pairs.addPlace('target', place(2), habit);
  pairs.toggleDropped(key);
  pairs.registered({ ...family, version: 4n, reports: [] });
  const seen = () => pairs.list.pairs.map(({ number }) => number);
  assert.deepEqual([seen(), pairs.list.dropped], [[1, 2], []], 'the other one is the user\'s');
  pairs.undo();
  assert.deepEqual([seen(), pairs.list.dropped], [[1, 2], []]);
  pairs.undo();
  pairs.undo();
  assert.deepEqual(seen(), [2]);
  pairs.addPlace('source', place(3), habit);
  assert.deepEqual(seen(), [2, 3], 'numbers are not used again');
});

test('NumbersOfReplacedPairsAreNotUsedAgain', () => {
  const files = new PairFiles();
  const first = files.read(written, 'a.json', false, [withPairs(2), emptyList]);
  const list = files.read(written, 'b.json', false, first)[0]!;
  assert.deepEqual(
    list.pairs.map(({ number }) => number),
    [5, 6],
  );
});
