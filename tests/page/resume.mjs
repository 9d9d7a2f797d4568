// Uploads a file by tus-js-client, as a page would, and goes on by itself after what fails:
//   node resume.mjs FOLDER_OF_MODULES ENDPOINT FILE
// Says in one line of JSON at which offsets the server wanted it to go on, and how often it tried again.
import { readFile } from "node:fs/promises";
import { createRequire } from "node:module";
import { basename } from "node:path";

const [modules, endpoint, file] = process.argv.slice(2);
const tus = createRequire(`${modules}/`)("tus-js-client");

const bytes = await readFile(file);
const offsets = [];
let retries = 0;
await new Promise((resolve, reject) => {
  const upload = new tus.Upload(bytes, {
    endpoint,
    metadata: { filename: basename(file) },
    retryDelays: Array(80).fill(250),
    onShouldRetry: () => Boolean(++retries),
    onAfterResponse: (request, response) => {
      if (request.getMethod() === "HEAD") offsets.push(Number(response.getHeader("Upload-Offset")));
    },
    onSuccess: resolve,
    onError: reject,
  });
  upload.start();
});
console.log(JSON.stringify({ offsets, retries }));
