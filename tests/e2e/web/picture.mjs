// Takes a picture of the page, half-way between two simulations:
//   BASE_URL=http://127.0.0.1:8080 node picture.mjs page.png
import { chromium } from 'playwright-core';

const [path] = process.argv.slice(2);
if (!process.env.BASE_URL || !path) {
  console.error('picture.mjs: BASE_URL must be the address of a server, and a file be named');
  process.exit(2);
}
const browser = await chromium.launch({
  executablePath: process.env.CHROMIUM ?? '/usr/bin/chromium',
  args: ['--no-sandbox', '--enable-unsafe-swiftshader'],
});
try {
  const page = await browser.newPage({ viewport: { width: 1280, height: 800 }, colorScheme: 'dark' });
  await page.goto(`${process.env.BASE_URL}/#view?family=two_drops&w=0.5&t=0.67`);
  await page.waitForFunction(() => globalThis.liquidblend?.panes[0]?.settled, null, { timeout: 60_000 });
  await page.screenshot({ path });
} finally {
  await browser.close();
}
