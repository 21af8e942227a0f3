// Runs the test files four at a time (tests mostly wait): node run.mjs [PATTERN...], where
// PATTERN selects files whose name contains it. By default Node runs as many files at a time as
// there are cores, minus one.
import fs from 'node:fs';
import path from 'node:path';
import { run } from 'node:test';
import { tap } from 'node:test/reporters';
import { fileURLToPath } from 'node:url';

const here = path.dirname(fileURLToPath(import.meta.url));
const patterns = process.argv.slice(2);
const files = fs
  .readdirSync(here)
  .filter((name) => name.endsWith('.test.mjs'))
  .filter((name) => !patterns.length || patterns.some((pattern) => name.includes(pattern)))
  .map((name) => path.join(here, name));
if (!files.length) throw new Error(`no test file is named like ${patterns.join(' or ')}`);

run({ files, concurrency: 4 })
  .on('test:fail', () => {
    process.exitCode = 1;
  })
  .compose(tap)
  .pipe(process.stdout);
