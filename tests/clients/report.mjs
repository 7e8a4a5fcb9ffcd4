// Opens a report.html in headless Chromium as a reader does: from disk, without a network, on a phone and on a desktop,
// in light and dark, by keyboard.
//
//   node report.mjs REPORT.html [-o DIR]
//
// Fails on any console message of error, request, picture that did not load, horizontal overflow, control without a name,
// picture without text, table without headers, or slider that the arrow keys don't move. With DIR, screenshots are
// written there.
import { mkdirSync } from 'node:fs';
import { join, resolve } from 'node:path';
import { pathToFileURL } from 'node:url';
import { parseArgs } from 'node:util';
import { withBrowser } from './browser.mjs';

const { values: options, positionals } = parseArgs({ allowPositionals: true, options: { out: { type: 'string', short: 'o' } } });
if (positionals.length !== 1) {
  console.error('usage: node report.mjs REPORT.html [-o DIR]');
  process.exit(2);
}
const url = pathToFileURL(resolve(positionals[0])).href;
if (options.out) mkdirSync(options.out, { recursive: true });

const LOOKS = [
  { name: '360-light', width: 360, height: 740, colorScheme: 'light' },
  { name: '360-dark', width: 360, height: 740, colorScheme: 'dark' },
  { name: '1600-light', width: 1600, height: 1000, colorScheme: 'light' },
  { name: '1600-dark', width: 1600, height: 1000, colorScheme: 'dark' },
];

/** Runs in the page: everything wrong that can be seen without moving anything. */
function look() {
  const faults = [];
  const root = document.documentElement;
  if (root.scrollWidth > root.clientWidth) {
    const wide = [...document.body.querySelectorAll('*')].filter(
      (e) => e.getBoundingClientRect().right > root.clientWidth + 1 && !e.closest('.scroll'),
    );
    faults.push(`${root.scrollWidth} pixels wide in ${root.clientWidth}: ${wide.slice(0, 3).map((e) => e.outerHTML.slice(0, 80)).join(' | ')}`);
  }
  if (!root.lang) faults.push('no language');
  if (document.querySelectorAll('h1').length !== 1) faults.push('not one h1');
  if (document.images.length === 0) faults.push('no picture');
  for (const image of document.images) {
    if (!image.complete || image.naturalWidth === 0) faults.push(`picture did not load: ${image.alt}`);
    if (!image.alt) faults.push('picture without text');
    if (image.getBoundingClientRect().width === 0) faults.push(`picture without size: ${image.alt}`);
  }
  for (const drawing of document.querySelectorAll('svg[role=img]')) {
    if (!drawing.getAttribute('aria-label')) faults.push('diagram without text');
    if (/NaN|Infinity/.test(drawing.outerHTML)) faults.push(`diagram with no number: ${drawing.getAttribute('aria-label')}`);
  }
  for (const table of document.querySelectorAll('table')) {
    if (!table.caption) faults.push('table without caption');
    for (const head of table.querySelectorAll('th')) if (!head.scope) faults.push(`th without scope: ${head.textContent}`);
    // With rows that span, every row has to end at the same column.
    const columns = table.tHead.rows[0].cells.length;
    const taken = [];
    for (const [y, row] of [...table.tBodies[0].rows].entries()) {
      let x = taken[y] ?? 0;
      for (const cell of row.cells) {
        for (let below = 1; below < cell.rowSpan; below++) taken[y + below] = (taken[y + below] ?? 0) + cell.colSpan;
        x += cell.colSpan;
      }
      if (x !== columns) faults.push(`row ${y} of "${table.caption.textContent.slice(0, 30)}" has ${x} columns of ${columns}`);
    }
  }
  for (const link of document.querySelectorAll('a[href^="#"]')) {
    if (!document.getElementById(link.getAttribute('href').slice(1))) faults.push(`link to nowhere: ${link.textContent}`);
  }
  return faults;
}

/** Tabs to the first slider and moves it by keys; the pictures have to follow. */
async function slide(page) {
  const faults = [];
  const slider = page.locator('input[type=range]').first();
  const border = () => page.locator('.pair .level').first().evaluate((e) => getComputedStyle(e).clipPath);
  let reached = false;
  for (let i = 0; i < 60 && !reached; i++) {
    await page.keyboard.press('Tab');
    reached = await slider.evaluate((e) => e === document.activeElement);
  }
  if (!reached) return ['the tab key does not reach the slider'];
  const before = await border();
  for (let i = 0; i < 20; i++) await page.keyboard.press('ArrowRight');
  if ((await slider.inputValue()) !== '70') faults.push(`20 steps to the right lead to ${await slider.inputValue()}`);
  const after = await border();
  if (before === after || !after.includes('70%')) faults.push(`the picture stays at ${after}`);
  await page.keyboard.press('Home');
  if (!(await border()).includes(' 0%') && !(await border()).includes('0px 0px 0px 0%') && (await slider.inputValue()) !== '0') faults.push('Home does not show the level alone');
  const name = await slider.getAttribute('aria-label');
  if (!name || !(await slider.getAttribute('aria-valuetext'))) faults.push('the slider has no name or value to read out');
  for (let i = 0; i < 50; i++) await page.keyboard.press('ArrowRight');
  return faults;
}

const faults = await withBrowser(async (browser) => {
  const found = [];
  for (const { name, width, height, colorScheme } of LOOKS) {
    const context = await browser.newContext({ viewport: { width, height }, colorScheme, offline: true });
    const page = await context.newPage();
    const say = (fault) => found.push(`${name}: ${fault}`);
    page.on('pageerror', (error) => say(error.message));
    page.on('console', (message) => ['error', 'warning'].includes(message.type()) && say(message.text()));
    page.on('request', (request) => {
      if (request.url() !== url && !request.url().startsWith('data:')) say(`asks for ${request.url()}`);
    });
    await page.goto(url);
    (await page.evaluate(look)).forEach(say);
    (await slide(page)).forEach(say);
    if (options.out) {
      await page.screenshot({ path: join(options.out, `${name}.png`) });
      await page.screenshot({ path: join(options.out, `${name}-all.png`), fullPage: true });
    }
    await context.close();
  }
  return found;
});
for (const fault of faults) console.error(`FAIL ${fault}`);
if (faults.length === 0) console.log(`${positionals[0]}: opens and reads well at ${LOOKS.map((l) => l.name).join(', ')}`);
process.exit(faults.length ? 1 : 0);
