import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { mkdtempSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { test } from 'node:test';
import { ApiError } from '../src/api/errors.ts';
import { isId, toId } from '../src/api/names.ts';
import { toJob } from '../src/api/operations.ts';
import { LineSplitter, parseLine, readLines } from '../src/api/watch_lines.ts';
import { folderOfInput, isOfAnimation } from '../src/jobs/folder.ts';
import { emptyForm, faultOf, requestOf } from '../src/jobs/register_request.ts';
import { tarOf } from '../src/jobs/tar.ts';
import { leftText, progressFigures, spanText, stageText } from '../src/jobs/words.ts';

test('ArchivesOfFilesAreReadByTar', async () => {
  const long = `${'frame_'.repeat(20)}é_0001.ply`;
  const files = [
    { name: 'meta.json', file: new Blob(['{}']) },
    { name: 'empty.ply', file: new Blob([]) },
    { name: long, file: new Blob(['x'.repeat(1537)]) },
  ];
  const folder = mkdtempSync(join(tmpdir(), 'tar-'));
  try {
    writeFileSync(join(folder, 'a.tar'), Buffer.from(await tarOf(files).arrayBuffer()));
    const tar = (...args: string[]) =>
      execFileSync('tar', args, {
        cwd: folder,
        encoding: 'utf8',
        env: { ...process.env, LC_ALL: 'C.UTF-8' },
      });
    const lines = tar('--quoting-style=literal', '-tvf', 'a.tar').trim().split('\n');
    assert.deepEqual(
      lines.map((line) => line.split(/\s+/)[2]),
      ['2', '0', '1537'],
    );
    assert.deepEqual(
      lines.map((line) => line.split(/\s+/).pop()),
      files.map(({ name }) => name),
    );
    tar('-xf', 'a.tar');
    assert.equal(readFileSync(join(folder, long), 'utf8').length, 1537);
  } finally {
    rmSync(folder, { recursive: true });
  }
});

test('ArchivesReadNoFileIntoMemory', () => {
  const files = Array.from({ length: 40 }, (_, i) => ({
    name: `f_${i}.ply`,
    file: new Blob([new Uint8Array(1 << 20)]),
  }));
  const before = process.memoryUsage().arrayBuffers;
  const archive = tarOf(files);
  assert.equal(archive.size, 40 * ((1 << 20) + 512) + 1024);
  assert.ok(process.memoryUsage().arrayBuffers - before < 1 << 20);
});

test('LinesArePutTogetherFromPieces', () => {
  const splitter = new LineSplitter();
  assert.deepEqual(splitter.push('{"a":'), []);
  assert.deepEqual(splitter.push('1}\n\n{"b":2}\r\n{"c"'), ['{"a":1}', '{"b":2}']);
  assert.deepEqual(splitter.push(':3}'), []);
  assert.deepEqual(splitter.end(), ['{"c":3}']);
  assert.deepEqual(splitter.end(), []);
});

test('AnErrorInMidStreamIsThrown', () => {
  assert.throws(
    () => parseLine('{"error":{"code":14,"message":"The server stops."}}'),
    (error) => error instanceof ApiError && error.message === 'The server stops.',
  );
  assert.throws(() => parseLine('{"name"'), ApiError);
  const failed = { name: 'operations/x', done: true, error: { code: 3, message: 'bad' } };
  assert.deepEqual(
    parseLine(JSON.stringify(failed)),
    failed,
    'an operation that failed is no such line',
  );
});

test('LinesAreReadOverTheBordersOfCharacters', async () => {
  const bytes = new TextEncoder().encode('{"a":"é"}\n{"b":"😀"}\n');
  const body = new ReadableStream<Uint8Array>({
    start(controller) {
      for (const byte of bytes) controller.enqueue(Uint8Array.of(byte));
      controller.close();
    },
  });
  const lines: unknown[] = [];
  for await (const line of readLines(body)) lines.push(line);
  assert.deepEqual(lines, [{ a: 'é' }, { b: '😀' }]);
});

test('OperationsBecomeJobs', () => {
  const metadata = {
    '@type': 'type.googleapis.com/liquidblend.v1.RegisterFamilyMetadata',
    family: 'families/f',
    progress: {
      stage: 'projection',
      iteration: 3,
      numIterations: 16,
      numInliers: '90',
      numSamples: '100',
      secondsLeft: 75,
    },
  };
  const running = toJob({ name: 'operations/r', metadata });
  assert.equal(running.state, 'running');
  assert.equal(running.kind, 'registration');
  assert.equal(running.subject, 'families/f');
  assert.equal(leftText(running.progress), 'about 75 s left');
  assert.deepEqual(progressFigures(running.progress), [
    { name: 'iteration', value: '3 of 16' },
    { name: 'inliers', value: '90.0 %' },
  ]);
  const failed = toJob({
    name: 'operations/r',
    metadata,
    done: true,
    error: { code: 3, message: 'no' },
  });
  assert.equal(failed.state, 'failed');
  assert.equal(failed.error?.message, 'no');
  assert.equal(
    toJob({ name: 'o', done: true, error: { code: 1, message: 'x' } }).state,
    'cancelled',
  );
  assert.equal(
    toJob({ name: 'o', metadata: { ...metadata, version: '7', grade: 'DOUBTFUL' }, done: true })
      .version,
    7n,
  );
});

test('StagesAndTimesAreWords', () => {
  assert.equal(stageText(toJob({ name: 'o' }).progress), 'Waiting');
  assert.deepEqual([1, 89, 120, 3700].map(spanText), ['1 s', '89 s', '2 min', '1 h 2 min']);
});

test('NamesComeFromFolders', () => {
  assert.equal(toId('My Shot (17)'), 'my_shot_17');
  assert.equal(toId('___'), '');
  assert.ok(isId(toId('Übung.2')));
  assert.equal(isId('-x'), false);
});

test('OnlyFramesOfTheFolderItselfAreTaken', () => {
  const file = (path: string) => {
    const made = new File(['x'], path.split('/').pop()!);
    return Object.defineProperty(made, 'webkitRelativePath', { value: path });
  };
  const names = [
    'A/fluid_mesh_0002.bobj.gz',
    'A/fluid_mesh_0001.bobj.gz',
    'A/lVelMesh_0001.uni',
    'A/lVelMesh_0002.uni',
    'A/lVelMesh_0003.uni',
    'A/pp_0001.uni',
    'A/meta.json',
    'A/notes.txt',
    'A/more/fluid_mesh_0003.bobj.gz',
  ];
  const folder = folderOfInput(names.map(file));
  assert.equal(folder.name, 'A');
  assert.deepEqual(
    folder.files.map(({ name }) => name),
    [
      'fluid_mesh_0001.bobj.gz',
      'fluid_mesh_0002.bobj.gz',
      'lVelMesh_0001.uni',
      'lVelMesh_0002.uni',
      'meta.json',
    ],
  );
  assert.equal(folder.numSkipped, 4);
  assert.equal(isOfAnimation('liquid.0001.VDB'), true);
});

test('TheFormSaysWhatIsWrongBeforeItIsSent', () => {
  const form = emptyForm();
  assert.match(faultOf(form), /family's name/);
  const named = { ...form, family: 'f' };
  assert.match(faultOf(named), /Choose an animation/);
  const members = ['animations/a', 'animations/b'].map((animation) => ({
    animation,
    values: ['1'],
  }));
  assert.equal(faultOf({ ...named, members }), '');
  assert.match(faultOf({ ...named, members: [members[0]!, members[0]!] }), /twice/);
  assert.match(faultOf({ ...named, members, parameters: ['Width'] }), /no name of a parameter/);
  const lacking = [members[0]!, { animation: 'animations/b', values: [''] }];
  assert.match(faultOf({ ...named, members: lacking, parameters: ['width'] }), /needs a number/);
});

test('TheFormBecomesARequest', () => {
  const members = [
    { animation: 'animations/a', values: ['0.5'] },
    { animation: 'animations/b', values: ['1e0'] },
  ];
  const plain = {
    ...emptyForm(),
    family: 'f',
    members: members.map(({ animation }) => ({ animation, values: [] })),
  };
  assert.deepEqual(requestOf(plain), {
    familyId: 'f',
    source: 'animations/a',
    targets: ['animations/b'],
    options: {},
  });
  const full = {
    ...plain,
    members,
    parameters: ['width'],
    interpolation: 'SMOOTH' as const,
    iterations: '4',
    automatic: false,
    timeBlending: 'SQUARES' as const,
    restTime: '-0.5',
    requiredGrade: 'GOOD' as const,
    replace: true,
  };
  assert.deepEqual(requestOf(full), {
    familyId: 'f',
    source: 'animations/a',
    targets: ['animations/b'],
    options: { maxIterations: 4, automaticCorrespondences: false },
    parameterSpace: {
      names: ['width'],
      points: [{ values: [0.5] }, { values: [1] }],
      interpolation: 'SMOOTH',
    },
    timeBlending: { kind: 'SQUARES', restTimeS: -0.5 },
    requiredGrade: 'GOOD',
    replace: true,
  });
});
