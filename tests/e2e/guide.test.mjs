import assert from 'node:assert/strict';
import { spawnSync } from 'node:child_process';
import fs from 'node:fs';
import os from 'node:os';
import path from 'node:path';
import { test } from 'node:test';
import {
  accessibilityFaults,
  ask,
  desktop,
  phone,
  serverAndBrowser,
  settles,
  until,
  weigh,
} from './harness.mjs';

const names = ['start', 'concepts', 'api', 'integrator', 'operations', 'course'];
const binary = process.env.TESSERA_BINARY && path.resolve(process.env.TESSERA_BINARY);
/**
 * For each chapter: title, anchors of its sections, targets of its links, its commands, and its
 * words in code.
 */
const chapters = new Map();

async function readChapters() {
  const page = await openPage(desktop);
  for (const name of names) {
    await open(page, name);
    chapters.set(
      name,
      await page.getByTestId('chapter').evaluate((article) => {
        const all = (selector, of) => [...article.querySelectorAll(selector)].map(of);
        return {
          title: article.querySelector('h1').textContent,
          sections: all('h2', (h) => h.id),
          links: all('a', (a) => a.getAttribute('href')),
          commands: all('pre', (pre) => pre.textContent),
          words: all(':not(pre) > code', (code) => code.textContent),
        };
      }),
    );
  }
  await page.context().close();
}

async function open(page, name, section = '') {
  await page.goto(`${server.url}/#/guide/${name}${section && `/${section}`}`);
  await page.locator(`.guide-text h2 a[href^="#/guide/${name}/"]`).first().waitFor();
  await page.locator('.guide-text[aria-busy=false]').waitFor();
}

const withPage = (device, use) => withPageOf(device, '', use);

for (const [size, device] of [
  ['desktop', desktop],
  ['phone', phone],
]) {
  test(`WCAG 2.2 AA holds in every chapter on a ${size}`, { timeout: 300_000 }, () =>
    withPage(device, async (page) => {
      for (const name of names) {
        await open(page, name);
        const wide = await page.evaluate(() => document.documentElement.scrollWidth - innerWidth);
        assert.ok(wide <= 0, `${name} is ${wide} pixels too wide`);
        assert.deepEqual(await accessibilityFaults(page), [], name);
      }
    }),
  );

  test(`an address leads to its section on a ${size}`, { timeout: 300_000 }, () =>
    withPage(device, async (page) => {
      const top = (id) => page.locator(`#${id}`).evaluate((h) => h.getBoundingClientRect().top);
      for (const [name, { sections }] of chapters) {
        // Not the last one, which may be lower on the screen because the page ends.
        const id = sections[1];
        await open(page, name, id);
        await until(`${name}/${id} on top`, async () => {
          const y = await top(id);
          return y >= 0 && y < 150;
        });
        await settles('the focus', () => page.evaluate(() => document.activeElement.id), id);
      }
    }),
  );
}

test('the table of contents opens every chapter', { timeout: 300_000 }, () =>
  withPage(desktop, async (page) => {
    await page.getByRole('link', { name: 'Guide', exact: true }).click();
    const list = page.getByRole('navigation', { name: 'Chapters' });
    for (const [name, { title, sections }] of chapters) {
      await list.locator(`a[href="#/guide/${name}"]`).first().click();
      await until(title, async () => (await page.textContent('h1')) === title);
      await settles(
        `sections of ${name}`,
        () =>
          list
            .locator('ol.guide-sections >> visible=true')
            .locator('a')
            .evaluateAll((all) => all.map((a) => a.getAttribute('href'))),
        sections.map((id) => `#/guide/${name}/${id}`),
      );
    }
    await page.goto(`${server.url}/#/guide/nothing`);
    await page.getByRole('heading', { name: /There is no chapter/ }).waitFor();
  }),
);

test('every link of the guide has a target', async () => {
  const { experiments } = await (await ask(`${server.url}/v1/server`)).json();
  const visited = new Set();
  for (const [name, { links, sections }] of chapters) {
    assert.equal(new Set(sections).size, sections.length, name);
    for (const link of links) {
      const [hash, query = ''] = link.split('?');
      const [head, first = '', second = ''] = hash.replace(/^#\//, '').split('/');
      if (!link.startsWith('#')) {
        assert.ok((await ask(new URL(link, `${server.url}/`))).ok, `${name}: ${link}`);
      } else if (head === 'guide') {
        assert.ok(chapters.has(first), `${name}: ${link}`);
        assert.ok(!second || chapters.get(first).sections.includes(second), `${name}: ${link}`);
      } else if (head === 'lab') {
        const experiment = experiments.find((e) => e.name === first);
        assert.ok(experiment, `${name}: ${link}`);
        visited.add(first);
        for (const [key, value] of new URLSearchParams(query)) {
          const parameter = experiment.params.find((p) => p.name === key);
          const known =
            key === 'estimator'
              ? experiment.estimators.some((e) => e.name === value)
              : key === 'run'
                ? ['1', 'all'].includes(value)
                : key === 'sampler'
                  ? experiment.samplers.includes(value)
                  : key === 'replicates'
                    ? value >= 2 && value <= 4096
                    : parameter && value >= parameter.min && value <= parameter.max;
          assert.ok(known, `${name}: ${key}=${value} in ${link}`);
        }
      } else {
        assert.ok(['compare', 'jobs', 'settings'].includes(head), `${name}: ${link}`);
      }
    }
  }
  assert.deepEqual(
    experiments.map((e) => e.name).filter((each) => !visited.has(each)),
    [],
    'the course visits every experiment',
  );
});

test('a button of the course renders two jobs side by side', { timeout: 300_000 }, () =>
  withPage(desktop, async (page) => {
    await open(page, 'course');
    assert.ok((await page.locator('.guide-math math').count()) > 40);
    const buttons = page.locator('.guide-text button[data-pair]');
    await settles('a button in every chapter', () => buttons.count(), 16);
    await buttons.first().click();
    await until('the comparison', () => /#\/compare\/[^/]+\/[^/]+/.test(page.url()));
  }),
);

test('a link of the course starts its run', { timeout: 300_000 }, () =>
  withPage(desktop, async (page) => {
    await page.goto(`${server.url}/#/lab/mse?estimator=by-n&n=16,64,256&replicates=16&run=1`);
    const verdict = page.getByTestId('lab-verdict');
    await until('a verdict', async () => /variance/.test(await verdict.textContent()));
  }),
);

const helpOf = (verb) => {
  const run = spawnSync(binary, [verb, '--help'], { encoding: 'utf8' });
  assert.equal(run.status, 0, `tessera ${verb} --help`);
  return run.stdout;
};
const flagsIn = (text) => text.match(/(?<![\w-])--[a-z][a-z-]+/g) ?? [];

// With a server elsewhere (TESSERA_URL) there is no program to run.
const skip = binary ? false : 'TESSERA_BINARY does not name a program';
const { server, openPage, withPage: withPageOf } = serverAndBrowser({ afterStart: readChapters });

test('every flag in the guide exists', { skip }, () => {
  const known = new Map();
  const flagsOf = (verb) => {
    if (!known.has(verb)) known.set(verb, new Set(flagsIn(helpOf(verb))));
    return known.get(verb);
  };
  const scripts = ['tests/bench/run', 'server/run'].map((name) => ({
    name,
    flags: flagsIn(fs.readFileSync(new URL(`../../${name}`, import.meta.url), 'utf8')),
  }));
  const scriptOf = (word) => scripts.find(({ name }) => word.startsWith(name));
  let checked = 0;
  for (const [name, { commands, words }] of chapters) {
    for (const line of commands.join('\n').replace(/\\\n/g, ' ').split('\n')) {
      const [, program, verb] = /^(?:(tessera) ([a-z]+)|server\/run)/.exec(line) ?? [];
      if (!program && !/^server\/run/.test(line)) continue;
      for (const flag of flagsIn(line.replace(/#.*/, ''))) {
        assert.ok(flagsOf(verb ?? 'serve').has(flag), `${name}: ${line}`);
        checked += 1;
      }
    }
    const help = spawnSync(binary, ['--help'], { encoding: 'utf8' }).stdout;
    const verbs = [...help.matchAll(/^  ([a-z]+) {2,}/gm)].map((match) => match[1]);
    for (const word of words.filter(scriptOf)) {
      for (const flag of flagsIn(word)) {
        assert.ok(scriptOf(word).flags.includes(flag), `${name}: ${word}`);
        checked += 1;
      }
    }
    for (const flag of words.filter((word) => !scriptOf(word)).flatMap(flagsIn)) {
      assert.ok(
        flag === '--help' || verbs.some((verb) => flagsOf(verb).has(flag)),
        `${name}: ${flag}`,
      );
      checked += 1;
    }
  }
  assert.ok(checked > 40, `${checked} flags found`);
});

test(
  'the curl commands of the guide work',
  { skip, timeout: 300_000 },
  () => {
    const folder = fs.mkdtempSync(path.join(os.tmpdir(), 'tessera-guide-'));
    // In this order: the second chapter uses the job of the first.
    const script = ['start', 'concepts', 'integrator', 'operations', 'api']
      .flatMap((name) => chapters.get(name).commands)
      // A first key would close the server to the commands after it (tests/api/tenants_test.py).
      .filter((block) => /curl|^S=/.test(block) && !block.includes('TESSERA_KEY'))
      .join('\n')
      // Unchanged but for jobs that take as long as they ask: a second is enough, and four times
      // the error.
      .replace(/"seconds": [2-9]\b/g, '"seconds": 1')
      .replace(/"relative_error": ([\d.]+)/g, (_, error) => `"relative_error": ${4 * error}`)
      .replace(/error=5%/g, 'error=20%');
    assert.ok(script.split('curl ').length > 30);
    const run = spawnSync('bash', ['-eu', '-o', 'pipefail', '-c', script], {
      cwd: folder,
      encoding: 'utf8',
      env: {
        ...process.env,
        PATH: `${path.dirname(binary)}:${process.env.PATH}`,
        TESSERA_SERVER: server.url,
      },
    });
    fs.rmSync(folder, { recursive: true });
    assert.equal(run.status, 0, run.stderr + run.stdout.slice(-500));
  },
);

test('the page is smaller than 500 KB, and chapters of the guide are loaded on demand', () =>
  withPage(desktop, async (page) => {
    const asked = new Set();
    page.on('request', (request) => {
      const url = new URL(request.url());
      if (url.pathname === '/' || /\.(js|css|woff2|svg)$/.test(url.pathname)) asked.add(url.href);
    });
    const chapterFile = new RegExp(`/(${names.join('|')})-[^/]*\\.js`);
    await page.reload();
    await page.waitForSelector('h1');
    assert.deepEqual(
      [...asked].filter((url) => chapterFile.test(url)),
      [],
    );
    for (const name of names) await open(page, name);
    for (const hash of ['#/lab', '#/jobs', '#/compare']) await page.goto(`${server.url}/${hash}`);
    assert.equal([...asked].filter((url) => chapterFile.test(url)).length, names.length);
    let bytes = 0;
    for (const url of asked) bytes += await weigh(url.split('#')[0]);
    assert.ok(bytes > 50_000 && bytes < 500_000, `${bytes} bytes`);
  }));
