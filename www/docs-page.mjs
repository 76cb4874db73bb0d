// The documentation's Markdown as pages of a site.

import { readFile } from "node:fs/promises";
import { basename, dirname, join, posix } from "node:path";
import highlight from "highlight.js/lib/core";
import bash from "highlight.js/lib/languages/bash";
import javascript from "highlight.js/lib/languages/javascript";
import json from "highlight.js/lib/languages/json";
import rust from "highlight.js/lib/languages/rust";
import xml from "highlight.js/lib/languages/xml";
import { Marked } from "marked";

/** By the names that the pages have for them. */
const LANGUAGES = { js: javascript, jsx: javascript, json, rust, sh: bash, html: xml };
for (const [name, language] of Object.entries(LANGUAGES)) highlight.registerLanguage(name, language);

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
  em { color: var(--soft); }
  form { margin-top: 14px; } input { width: min(100%, 22rem); padding: 8px 12px; border: 1px solid var(--line); border-radius: 8px; background: var(--paper); color: inherit; font: inherit; box-sizing: border-box; }
  #sections { padding-left: 1.2em; } #sections:empty { display: none; }
  nav a { white-space: nowrap; margin-right: 14px; } nav a.page { display: none; } nav a[aria-current] { color: inherit; text-decoration: none; font-weight: 600; }
  .hljs-comment { color: var(--soft); font-style: italic; } .hljs-string, .hljs-attr, .hljs-number, .hljs-literal { color: light-dark(#7a4a00, #e7bd7a); }
  .hljs-keyword, .hljs-built_in, .hljs-name, .hljs-tag { color: light-dark(#7c2d5a, #e39ac3); } .hljs-title { color: var(--link); }
  @media (min-width: 76rem) {
    body { margin-left: 19rem; }
    nav.pages { position: fixed; left: 0; top: 0; bottom: 0; width: 15rem; padding: 24px; overflow-y: auto; line-height: 1.9; } nav.pages a, nav.pages a.page { display: block; }
  }`;

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
      code({ text, lang }) {
        const html = lang in LANGUAGES ? highlight.highlight(text, { language: lang }).value : escaped(text);
        return `<pre tabindex="0"><code>${html}</code></pre>\n`;
      },
    },
    walkTokens(token) {
      if (token.type === "link" || token.type === "image") token.href = address(token.href, token.type, isInSite);
    },
  });
  const markdown = await readFile(source, "utf8");
  const body = (await marked.parse(markdown)).replaceAll("<table>", '<div class="wide" tabindex="0"><table>').replaceAll("</table>", "</table></div>");
  const [, title] = /^# (.+)$/m.exec(markdown) ?? [null, basename(source)];
  const nav = await navigation(join(dirname(source), "index.md"), basename(source));
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
${nav}
<form role="search" onsubmit="return false"><input type="search" aria-label="Search these pages" placeholder="Search" /><ol id="sections" aria-live="polite"></ol></form>
<main>
${body}</main>
<script type="module" src="search.js"></script>
</body>
</html>
`;
}

/** Beside each page: the others, in the order of the list, and what else there is on the site. @param {string} index its file */
async function navigation(index, own) {
  const list = await readFile(index, "utf8");
  const pages = [...list.matchAll(/^\| \[([^\]]+)\]\(([\w-]+\.md)\)/gm)].map(([, title, file]) => [file, title]);
  const current = (file) => (file === own ? ' aria-current="page"' : "");
  const link = ([file, title]) => `<a class="page" href="${file.replace(/md$/, "html")}"${current(file)}>${escaped(title)}</a>`;
  const others = '<a href="api/index.html">API reference</a> <a href="../examples/index.html">Examples</a> <a href="../">The demo page</a>';
  return `<nav class="pages" aria-label="Pages"><a href="index.html"${current("index.md")}>Documentation</a> ${pages.map(link).join(" ")} ${others}</nav>`;
}

/**
 * The sections of a page, for the search.
 *
 * @param {string} source a file of `docs/`
 * @returns {Promise<{ href: string, page: string, title: string, text: string }[]>}
 */
export async function sectionsOf(source) {
  const seen = new Map();
  const markdown = await readFile(source, "utf8");
  const plain = (text) => text.replace(/!?\[([^\]]*)\]\([^)]*\)/g, "$1").replace(/[`*|#]/g, " ").replace(/\s+/g, " ").trim();
  const sections = markdown.split(/^(?=#{1,3} )/m).map((section) => /^#+ (.+)\n?([\s\S]*)/.exec(section)).filter(Boolean);
  const page = plain(sections[0]?.[1] ?? "");
  return sections.map(([, heading, text]) => ({
    href: `${basename(source).replace(/md$/, "html")}#${headingId(heading, seen)}`,
    ...{ page, title: plain(heading), text: plain(text) },
  }));
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
