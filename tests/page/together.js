// The service and the browser that the tests of a file share: each file runs in a process of its own.

import { after } from 'node:test';
import { browser, service } from './support.js';

export const [site, chrome] = await Promise.all([service(), browser()]);

after(async () => {
  await chrome.close();
  await site.stop();
});
