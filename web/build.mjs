// Bundles the page's libraries, one file each, into the folder given (target/vendor).
// The page asks for them when they are there and does without them when they are not.
import { build } from "esbuild";

const outdir = process.argv[2];
if (!outdir) {
  console.error("usage: node build.mjs OUTPUT_FOLDER");
  process.exit(2);
}

await build({
  entryPoints: { uplot: "libraries/uplot.js", tus: "libraries/tus.js" },
  outdir,
  bundle: true,
  minify: true,
  format: "esm",
  target: "es2022",
  legalComments: "inline",
  logLevel: "warning",
});
