// The documentation's Markdown as pages of a site.

import { readFile } from "node:fs/promises";
import { basename, posix } from "node:path";
import { Marked } from "marked";

const REPOSITORY = "https://github.com/deepsft/deepsft";
const STYLE = `
  :root { color-scheme: light dark; --paper: #f3eee4; --ink: #1b2328; --soft: #57626a; --link: #14424a; --line: #d5ccbb; --deep: #e6dfd1; }
  @media (prefers-color-scheme: dark) { :root { --paper: #15191c; --ink: #ece8df; --soft: #a6b0b5; --link: #8bd0d6; --line: #3a4449; --deep: #262d31; } }
  body { margin: 0 auto; max-width: 52rem; padding: 24px clamp(16px, 4vw, 40px) 64px; background: var(--paper); color: var(--ink); font: 16px/1.6 system-ui, sans-serif; overflow-wrap: break-word; }
  h1, h2, h3 { font-family: Georgia, serif; font-weight: 400; line-height: 1.2; margin: 1.6em 0 0.5em; }
  h1 { font-size: 2.3rem; } h2 { font-size: 1.55rem; } h3 { font-size: 1.2rem; }
  a { color: var(--link); text-underline-offset: 3px; }
  :focus-visible { outline: 2px solid currentColor; outline-offset: 3px; }
  img { max-width: 100%; height: auto; background: #fff; border-radius: 6px; }
  .wide { overflow-x: auto; }
  table { border-collapse: collapse; font-size: 0.94em; }
  th, td { padding: 6px 12px 6px 0; border-bottom: 1px solid var(--line); text-align: left; vertical-align: top; }
  code { font: 0.88em ui-monospace, Menlo, Consolas, monospace; background: var(--deep); padding: 1px 5px; border-radius: 4px; }
  pre { padding: 14px 16px; overflow-x: auto; background: var(--deep); border-radius: 10px; line-height: 1.45; } pre code { padding: 0; background: none; }
  em { color: var(--soft); }`;

/**
 * @param {string} source a file of `docs/`
 * @param {(name: string) => boolean} isInSite whether the site has a file of that name
 * @returns {Promise<string>} HTML
 */
export async function docsPage(source, isInSite) {
  const seen = new Map();
  const marked = new Marked({
    renderer: {
      heading({ tokens, depth, text }) {
        const id = headingId(text, seen);
        return `<h${depth} id="${id}">${this.parser.parseInline(tokens)}</h${depth}>\n`;
      },
      code({ text }) {
        return `<pre tabindex="0"><code>${escaped(text)}</code></pre>\n`;
      },
    },
    walkTokens(token) {
      if (token.type === "link" || token.type === "image") token.href = address(token.href, token.type, isInSite);
    },
  });
  const markdown = await readFile(source, "utf8");
  const body = (await marked.parse(markdown)).replaceAll("<table>", '<div class="wide" tabindex="0"><table>').replaceAll("</table>", "</table></div>");
  const [, title] = /^# (.+)$/m.exec(markdown) ?? [null, basename(source)];
  const up = basename(source) === "index.md" ? '<a href="../">The demo page</a> · <a href="../examples/index.html">Examples</a>' : '<a href="index.html">All pages</a>';
  return `<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8" />
<meta name="viewport" content="width=device-width, initial-scale=1" />
<title>${escaped(title)}</title>
<link rel="icon" href="../demo/icon.svg" />
<style>${STYLE}</style>
</head>
<body>
<nav>${up}</nav>
<main>
${body}</main>
</body>
</html>
`;
}

/** Where a link of a page leads on the site, or in the repository where the site has no such file. */
function address(href, type, isInSite) {
  if (/^(\w+:|#)/.test(href)) return href;
  const [path, hash] = href.split("#");
  const inRepository = posix.join("www/docs", path);
  const name = inRepository.replace(/^www\//, "");
  const end = hash === undefined ? "" : `#${hash}`;
  if (!isInSite(name)) return `${REPOSITORY}/${type === "image" ? "raw" : "blob"}/main/${inRepository}${end}`;
  const page = /^docs\/[^/]+\.md$/.test(name) ? name.replace(/md$/, "html") : name;
  return posix.relative("docs", page) + end;
}

/** As on GitHub. @param {string} text @param {Map<string, number>} seen */
export function headingId(text, seen) {
  const plain = text.toLowerCase().replace(/[^\p{L}\p{N}\s_-]/gu, "").trim().replace(/\s/g, "-");
  const before = seen.get(plain) ?? 0;
  seen.set(plain, before + 1);
  return before === 0 ? plain : `${plain}-${before}`;
}

const escaped = (text) => text.replace(/[&<>"]/g, (sign) => `&#${sign.charCodeAt(0)};`);
