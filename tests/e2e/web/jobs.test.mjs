import assert from 'node:assert/strict';
import { readFileSync, readdirSync } from 'node:fs';
import { after, before, test } from 'node:test';
import { api, ensureClips, ensureFamily, folderOf } from './library.mjs';
import { baseUrl, newPage, report, slowness, waitFor } from './page.mjs';

const made = { animations: [], families: [] };
let clips;

before(async () => {
  clips = await ensureClips();
});

after(async () => {
  for (const id of made.families) await api(`/v1/families/${id}`, { method: 'DELETE' });
  for (const id of made.animations) await api(`/v1/animations/${id}`, { method: 'DELETE' });
});

/** A name that no run before had. */
function fresh(kind) {
  const id = `e2e_${kind}_${Date.now().toString(36)}_${Math.floor(Math.random() * 1e6).toString(36)}`;
  made[kind === 'family' ? 'families' : 'animations'].push(id);
  return id;
}

async function withJobs(view, act, options = {}) {
  const page = await newPage(options);
  try {
    await page.goto(`${baseUrl}/#jobs?show=${view}`);
    await act(page);
    assert.deepEqual(
      page.seen.errors.filter((error) => !/status of 4\d\d/.test(error)),
      [],
    );
    assert.deepEqual(await page.evaluate(() => globalThis.violations), []);
  } finally {
    await page.context().close();
  }
}

function card(page, id, kind = 'Import') {
  return page.getByRole('article', { name: `${kind} of ${id}` }).first();
}

test('FoldersAreUploadedByTheChooser', () =>
  withJobs('upload', async (page) => {
    const id = fresh('clip');
    await page.getByLabel('Folder of frames').setInputFiles(folderOf('dam_break_clip/w0_p0'));
    await page.getByText(/25 files, /).waitFor();
    assert.equal(await page.getByLabel(/^Name/).inputValue(), 'w0_p0');
    await page.getByLabel(/^Name/).fill(id);
    await page.getByLabel(/^Frames a second/).fill('48');
    await page.getByLabel(/^Up/).selectOption('UP_Z');
    const [request] = await Promise.all([
      page.waitForRequest(/animations:upload/),
      page.getByRole('button', { name: 'Upload', exact: true }).press('Enter'),
    ]);
    const fields = new URL(request.url()).searchParams;
    assert.equal(fields.get('header.options.framesPerSecond'), '48');
    assert.equal(fields.get('header.options.up'), 'UP_Z');
    assert.equal(fields.get('header.numFiles'), '25');
    await card(page, id).getByText('done', { exact: true }).waitFor({ timeout: 30_000 * slowness });
    const { json } = await api(`/v1/animations/${id}`);
    assert.equal(json.state, 'READY');
    assert.equal(json.framesPerSecond, 48);
    await page.getByRole('link', { name: 'Animations' }).click();
    const article = page.getByRole('article', { name: id });
    await article.getByText('ready').waitFor();
    await article.getByText(/notes? of the import/).click();
    for (const note of json.notes) await article.getByText(note).waitFor();
    await article.getByRole('button', { name: `Delete ${id}` }).click();
    await page.getByRole('dialog').getByRole('button', { name: 'Cancel' }).click();
    assert.equal((await api(`/v1/animations/${id}`)).status, 200, 'asked first');
    await article.getByRole('button', { name: `Delete ${id}` }).click();
    await page.getByRole('dialog').getByRole('button', { name: 'Delete' }).click();
    await article.waitFor({ state: 'hidden' });
    assert.equal((await api(`/v1/animations/${id}`)).status, 404);
  }));

/** Drops files of a folder of the tests onto the page. */
async function drop(page, folder) {
  const files = readdirSync(folderOf(folder)).map((name) => ({
    name,
    data: readFileSync(`${folderOf(folder)}/${name}`).toString('base64'),
  }));
  const transfer = await page.evaluateHandle((all) => {
    const made = new DataTransfer();
    for (const { name, data } of all) {
      const bytes = Uint8Array.from(atob(data), (one) => one.charCodeAt(0));
      made.items.add(new File([bytes], name));
    }
    return made;
  }, files);
  await page.locator('lb-upload .drop').dispatchEvent('drop', { dataTransfer: transfer });
}

test('FilesAreUploadedByDrop', () =>
  withJobs('upload', async (page) => {
    const id = fresh('clip');
    await drop(page, 'dam_break_clip/w1_p1');
    await page.getByText(/25 files, /).waitFor();
    await page.getByLabel(/^Name/).fill('Not A Name');
    await page.getByRole('button', { name: 'Upload', exact: true }).click();
    await page.getByRole('alert').filter({ hasText: 'The name may have' }).waitFor();
    await page.getByLabel(/^Name/).fill(id);
    await page.getByRole('button', { name: 'Upload', exact: true }).click();
    await card(page, id).getByText('done', { exact: true }).waitFor({ timeout: 30_000 * slowness });
  }));

test('AnUploadShowsItsProgressGoesOnAndStops', () =>
  withJobs('upload', async (page) => {
    const id = fresh('clip');
    const session = await page.context().newCDPSession(page);
    await session.send('Network.enable');
    const slow = { offline: false, latency: 0, downloadThroughput: -1, uploadThroughput: 300_000 };
    await session.send('Network.emulateNetworkConditions', slow);
    await drop(page, 'dam_break_clip/w0_p0');
    await page.getByLabel(/^Name/).fill(id);
    await page.getByRole('button', { name: 'Upload', exact: true }).click();
    const bar = page.getByRole('progressbar', { name: /upload/ });
    await bar.waitFor();
    const moved = await page.waitForFunction(() => {
      const find = (root) => {
        for (const element of root.querySelectorAll('*')) {
          if (element.localName === 'progress' && element.value > 0 && element.value < element.max)
            return element.value;
          const inner = element.shadowRoot && find(element.shadowRoot);
          if (inner) return inner;
        }
        return 0;
      };
      return find(document);
    });
    assert.ok((await moved.jsonValue()) > 0);
    await page.getByRole('link', { name: 'Families', exact: true }).click();
    await bar.waitFor({ state: 'hidden' });
    await page.getByRole('link', { name: 'Upload', exact: true }).click();
    await bar.waitFor();
    assert.ok((await bar.evaluate((element) => element.value)) >= (await moved.jsonValue()));
    await page.getByRole('button', { name: 'Stop' }).click();
    await bar.waitFor({ state: 'hidden' });
    assert.equal((await api(`/v1/animations/${id}`)).status, 404, 'nothing is left');
  }));

test('ErrorsOfUploadsAreTold', () =>
  withJobs('upload', async (page) => {
    await drop(page, 'dam_break_clip/w0_p0');
    await page.getByLabel(/^Name/).fill('e2e_clip_0');
    await page.getByRole('button', { name: 'Upload', exact: true }).click();
    await page.getByRole('alert').filter({ hasText: 'e2e_clip_0' }).waitFor();
    await page.getByRole('button', { name: 'Upload', exact: true }).waitFor();
  }));

test('FamiliesAreRegisteredByKeysWithProgressAndVerdict', () =>
  withJobs('register', async (page) => {
    const id = fresh('family');
    await page.getByLabel('Name of the family').focus();
    await page.keyboard.type(id);
    await page.getByLabel('Source', { exact: true }).selectOption(clips[0]);
    await page.getByLabel('Target 1', { exact: true }).selectOption(clips[1]);
    await page.getByText('Options', { exact: true }).focus();
    await page.keyboard.press('Enter');
    await page.getByLabel(/^Iterations/).fill('3');
    const stages = new Set();
    await page.exposeFunction('noteStage', (text) => stages.add(text));
    await page.evaluate(() => {
      setInterval(() => {
        const jobs = document
          .querySelector('lb-page')
          ?.shadowRoot.querySelector('lb-jobs')?.shadowRoot;
        const list = jobs?.querySelector('lb-operations')?.shadowRoot;
        for (const job of list?.querySelectorAll('lb-job') ?? []) {
          const stage = job.shadowRoot.querySelector('.stage');
          if (stage) globalThis.noteStage(stage.firstElementChild.textContent);
        }
      }, 30);
    });
    await page.getByRole('button', { name: 'Register', exact: true }).focus();
    await page.keyboard.press('Enter');
    const job = card(page, id, 'Registration');
    await job.getByRole('progressbar').waitFor();
    await job.getByText('done', { exact: true }).waitFor({ timeout: 60_000 * slowness });
    report('stages', [...stages]);
    assert.ok(stages.size >= 2, [...stages].join());
    await job.getByRole('link', { name: 'Verdict' }).click();
    const verdicts = page.getByRole('region', { name: 'Verdicts' });
    const { json } = await api(`/v1/families/${id}`);
    const { verdict } = json.reports[0];
    await verdicts.getByText(verdict.reason).waitFor();
    await verdicts.getByText('All figures').click();
    await verdicts
      .getByText(`${(100 * verdict.coveredShare).toFixed(1)} %`)
      .first()
      .waitFor();
    await verdicts.getByRole('button', { name: 'Go to the worst place' }).click();
    await page.waitForURL(/#view\?.*family=/);
    const pane = await waitFor(page, ({ shown }) => shown > 0);
    assert.ok(Math.abs(pane.timeS - (verdict.worst.timeS ?? 0)) < 1e-3);
    const { state } = await page.evaluate(() => globalThis.liquidblend);
    assert.deepEqual(state.weights, [0.5]);
    assert.deepEqual(state.beside, ['source', 'target.1']);
  }));

test('RegistrationsAreCancelled', () =>
  withJobs('operations', async (page) => {
    const id = fresh('family');
    const body = {
      familyId: id,
      source: clips[0],
      targets: [clips[1]],
      options: { maxIterations: 200 },
    };
    await api('/v1/families', { method: 'POST', body });
    const job = card(page, id, 'Registration');
    await job.getByRole('button', { name: 'Cancel' }).click({ timeout: 15_000 * slowness });
    await job.getByText('cancelled', { exact: true }).waitFor({ timeout: 30_000 * slowness });
    await job.getByRole('button', { name: 'Remove from the list' }).click();
    await job.waitFor({ state: 'hidden' });
  }));

test('FaultsOfTheFormAreToldBeforeAndAfter', () =>
  withJobs('register', async (page) => {
    await page.getByLabel('Name of the family').fill('e2e_pad');
    await page.getByRole('button', { name: 'Register', exact: true }).click();
    const alert = page.getByRole('alert');
    await alert.filter({ hasText: 'Choose an animation' }).waitFor();
    await page.getByLabel('Source', { exact: true }).selectOption(clips[0]);
    await page.getByLabel('Target 1', { exact: true }).selectOption(clips[1]);
    await page.getByRole('button', { name: 'Add a parameter' }).click();
    await page.getByLabel('Name of parameter 1').fill('width');
    await page.getByRole('button', { name: 'Register', exact: true }).click();
    await alert.filter({ hasText: 'needs a number' }).waitFor();
    await page.getByLabel('width of source').fill('1');
    await page.getByLabel('width of target 1').fill('1');
    await page.getByRole('button', { name: 'Register', exact: true }).click();
    await alert.filter({ hasText: 'width' }).waitFor();
  }));

test('VersionsAreRefinedComparedAndRolledBack', () =>
  withJobs('families', async (page) => {
    const id = fresh('family');
    await ensureFamily(id, {
      source: clips[0],
      targets: [clips[1]],
      options: { maxIterations: 1 },
      spaceTime: { coarserLevels: 0 },
    });
    await page.goto(`${baseUrl}/#jobs?show=families&family=${id}`);
    const versions = page.getByRole('region', { name: 'Versions' });
    await versions.getByText('No version before this one').waitFor();
    await versions.getByLabel('Iterations').fill('1');
    await versions.getByRole('button', { name: 'Refine' }).click();
    await card(page, id, 'Registration')
      .getByText('done', { exact: true })
      .waitFor({ timeout: 60_000 * slowness });
    assert.equal((await api(`/v1/families/${id}`)).json.version, '2');
    await page.goto(`${baseUrl}/#jobs?show=families&family=${id}`);
    await versions.getByRole('button', { name: 'Publish again' }).click();
    await page.getByRole('dialog').getByRole('button', { name: 'Publish' }).click();
    await page.getByText('is again version').waitFor();
    const { json } = await api(`/v1/families/${id}`);
    assert.deepEqual([json.version, json.restoredVersion], ['3', '1']);
    await versions.getByRole('link', { name: 'Compare' }).first().click();
    await page.waitForFunction(() => globalThis.liquidblend?.panes.length === 2);
    await waitFor(page, ({ shown }) => shown > 0);
    await page.goto(`${baseUrl}/#jobs?show=families&family=${id}`);
    await page.getByRole('region', { name: id }).getByRole('button', { name: 'Delete' }).click();
    await page.getByRole('dialog').getByRole('button', { name: 'Delete' }).click();
    await page.waitForURL((url) => !url.href.includes(id));
    assert.equal((await api(`/v1/families/${id}`)).status, 404);
  }));

const markup = '<img src=x onerror="globalThis.hacked=1"><script>globalThis.hacked=1</script>';

test('HostileNamesNotesAndErrorsAreText', () =>
  withJobs('operations', async (page) => {
    const animation = {
      name: `animations/${markup}`,
      state: 'FAILED',
      error: { code: 3, message: markup },
      notes: [markup],
    };
    const report = {
      target: animation.name,
      verdict: { grade: 'DOUBTFUL', reason: markup, worst: { position: {} } },
    };
    const hypothesis = { pairing: markup, cost: 1 };
    const family = {
      name: `families/${markup}`,
      version: '1',
      source: animation.name,
      targets: [animation.name],
      reports: [{ ...report, hypotheses: [hypothesis] }],
      failedRegistration: { error: { code: 3, message: markup } },
      timeBlending: { kind: 'LINEAR', reason: markup },
    };
    const metadata = {
      '@type': 'type.googleapis.com/liquidblend.v1.RegisterFamilyMetadata',
      family: family.name,
      progress: {
        stage: markup,
        waitingFor: markup,
        worker: markup,
        lastFailure: { code: 3, message: markup },
      },
    };
    const operations = [
      { name: 'operations/a', metadata },
      { name: 'operations/b', metadata, done: true, error: { code: 3, message: markup } },
    ];
    await page.route(/\/v1\/animations(\?|$)/, (route) =>
      route.fulfill({ json: { animations: [animation] } }),
    );
    await page.route(/\/v1\/families(\?|$)/, (route) =>
      route.fulfill({ json: { families: [family] } }),
    );
    await page.route(/\/v1\/families\/./, (route) => route.fulfill({ json: family }));
    await page.route(/\/v1\/operations(\?|$)/, (route) => route.fulfill({ json: { operations } }));
    await page.route(/:watch/, (route) =>
      route.fulfill({
        contentType: 'application/x-ndjson',
        body: `${JSON.stringify(operations[0])}\n`,
      }),
    );
    for (const view of [
      'operations',
      'animations',
      `families&family=${encodeURIComponent(markup)}`,
      'register',
    ]) {
      await page.goto(`${baseUrl}/#jobs?show=${view}`);
      await page.reload();
      if (view !== 'register') await page.locator('main').getByText('onerror').first().waitFor();
      await page.waitForTimeout(100);
      assert.equal(await page.evaluate(() => globalThis.hacked), undefined);
      assert.equal(await page.locator('img').count(), 0);
      assert.ok(
        await page.evaluate(() => document.documentElement.scrollWidth <= innerWidth),
        view,
      );
    }
  }));
