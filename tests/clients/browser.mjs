// A headless Chromium without GPU or network, and a server that gives it this folder and the files to be drawn.
import { createServer } from 'node:http';
import { createReadStream, statSync } from 'node:fs';
import { dirname, extname, join, normalize } from 'node:path';
import { chromium } from 'playwright-core';

const HERE = import.meta.dirname ?? new URL('.', import.meta.url).pathname;
const TYPES = { '.html': 'text/html', '.js': 'text/javascript', '.mjs': 'text/javascript', '.glb': 'model/gltf-binary', '.json': 'application/json', '.png': 'image/png', '.css': 'text/css' };

const FLAGS = [
  '--no-sandbox',
  '--use-angle=swiftshader',
  '--enable-unsafe-swiftshader',
  '--ignore-gpu-blocklist',
  '--disable-background-networking',
  '--disable-component-update',
  '--disable-default-apps',
  '--disable-sync',
  '--no-first-run',
];

/** Serves this folder at /, `files[i]` at /file/i, what lies beside it at /file/i/NAME, and `folder` at /package. */
function serve(files, folder) {
  const server = createServer((request, response) => {
    const path = normalize(decodeURIComponent(new URL(request.url, 'http://localhost').pathname));
    const numbered = path.match(/^\/file\/(\d+)(?:\/([^/]+))?$/);
    const packaged = folder && path.match(/^\/package\/([^/]+)$/);
    const named = numbered && files[Number(numbered[1])];
    const file = named ? (numbered[2] ? join(dirname(named), numbered[2]) : named) : packaged ? join(folder, packaged[1]) : join(HERE, path);
    try {
      statSync(file);
    } catch {
      response.writeHead(404).end();
      return;
    }
    response.writeHead(200, { 'content-type': TYPES[extname(file)] ?? 'application/octet-stream' });
    createReadStream(file).pipe(response);
  });
  return new Promise((done) => server.listen(0, '127.0.0.1', () => done(server)));
}

/** Starts a browser for `work(browser)` and cleans up. */
export async function withBrowser(work) {
  const browser = await chromium.launch({
    executablePath: process.env.CHROMIUM ?? '/usr/bin/chromium',
    args: FLAGS,
    headless: true,
  });
  try {
    return await work(browser);
  } finally {
    await browser.close();
  }
}

/** Opens `page` with `files` (and what is in `folder`) at hand, waits for `window.ready`, runs `work(page)` and cleans up. Page errors are errors. */
export async function withPage(html, files, work, folder) {
  const server = await serve(files, folder);
  try {
    return await withBrowser((browser) => onPage(browser, `http://127.0.0.1:${server.address().port}/${html}`, work));
  } finally {
    server.close();
  }
}

async function onPage(browser, url, work) {
  const page = await browser.newPage();
  const trouble = [];
  page.on('pageerror', (error) => trouble.push(error.message));
  page.on('console', (message) => {
    if (['error', 'warning'].includes(message.type())) trouble.push(message.text());
  });
  page.setDefaultTimeout(600_000);
  await page.goto(url);
  try {
    await page.waitForFunction('window.ready', undefined, { timeout: 60_000 });
  } catch {
    throw new Error(`the page did not start: ${trouble.join('; ') || 'no message'}`);
  }
  return await work(page, trouble);
}
