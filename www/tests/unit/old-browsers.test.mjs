// What the oldest supported browsers do not know is used only where the page does without it, by MDN's compatibility data. Built-ins of
// JavaScript are also held to ES2022 by tsconfig.json.

import assert from "node:assert/strict";
import { readFileSync, readdirSync } from "node:fs";
import { createRequire } from "node:module";
import { join } from "node:path";
import { test } from "node:test";
import { parse } from "acorn";
import postcss from "postcss";

import { WWW } from "../../serve.mjs";

const { api, css, html, javascript } = createRequire(import.meta.url)("@mdn/browser-compat-data");

/** As docs/browsers.md and the page's own message name them. */
const OLDEST = { chrome: 100, firefox: 114, safari_ios: 16.4 };

/** Newer than that, or known to a part of them only, and what happens without. */
const DONE_WITHOUT = {
  "Navigator.gpu": "asked for; else the processor computes",
  ".requestAdapter": "of navigator.gpu",
  ".architecture": "of a GPU's adapter",
  ".isFallbackAdapter": "of a GPU's adapter",
  ".requestVideoFrameCallback": "asked for; else each frame of the screen asks for another picture",
  ".presentationTime": "of requestVideoFrameCallback",
  VideoFrame: "asked for; else the browser draws the frame",
  ".visibleRect": "of a VideoFrame",
  ".rotation": "of a VideoFrame, 0 where there is none",
  ".flip": "of a VideoFrame, false where there is none",
  ".copyTo": "of a VideoFrame",
  ".imageSmoothingQuality": "a wish; else pictures are a little coarser",
  ".playsInline": "only iOS needs it",
  ".featurePolicy": "read if there; else a policy's refusal counts as the person's",
  ".allowsFeature": "of featurePolicy",
  ".createPolicy": "of Trusted Types, where a page may require it",
  "Symbol.dispose": "without it the method has a name that nobody calls; close() does the same",
  "Navigator.wakeLock": "called if there; else the screen goes off",
  "Navigator.canShare": "called if there; else the file is a download",
  "Navigator.share": "after canShare",
  ".mozHasAudio": "asked for; else audioTracks, else the bytes of sound that were decoded, else a film may have sound",
  ".audioTracks": "likewise",
  "Navigator.connection": "read if there",
  ".saveData": "of navigator.connection",
};

/** Names that BCD knows from newer interfaces, and we from our own objects and three.js. */
const OURS = [".projectionMatrix", ".radius", ".reasons"];

/** Global objects and what they are. */
const KINDS = {
  ...{ navigator: "Navigator", document: "Document", performance: "Performance", screen: "Screen", crypto: "Crypto" },
  ...{ caches: "CacheStorage", location: "Location", self: "Window", globalThis: "Window" },
};
const GLOBALS = [api, javascript.builtins, api.Window, api.WorkerGlobalScope, api.DedicatedWorkerGlobalScope];

/** The browsers of {@link OLDEST} that do not know a feature, with the version that does. */
function lacking(feature) {
  if (!feature?.__compat) return [];
  return Object.entries(OLDEST).flatMap(([browser, oldest]) => {
    const entries = [feature.__compat.support[browser] ?? []].flat();
    const known = entries.filter(({ prefix, flags, alternative_name: other }) => !prefix && !flags && !other);
    const since = Math.min(...known.map(({ version_added: version }) => parseFloat(String(version).replace("≤", "")) || Infinity));
    return since > oldest ? [`${browser} ${since === Infinity ? "never" : since}`] : [];
  });
}

const filesIn = (folder, ending) =>
  readdirSync(join(WWW, folder), { recursive: true })
    .filter((name) => name.endsWith(ending))
    .map((name) => join(folder, name));

/** Each node of a syntax tree with the one above it. */
function* nodesOf(node, above) {
  if (typeof node?.type !== "string") return;
  yield [node, above];
  for (const child of Object.values(node).flat()) yield* nodesOf(child, node);
}

/** Names that a module declares. */
function declaredIn(tree) {
  const names = new Set();
  const add = (pattern) => {
    for (const [node] of nodesOf(pattern)) if (node.type === "Identifier") names.add(node.name);
  };
  for (const [node] of nodesOf(tree)) {
    if (node.type === "VariableDeclarator" || /Function|Class/.test(node.type)) add(node.id);
    if (/Function/.test(node.type)) node.params.forEach(add);
    if (/^Import\w*Specifier$/.test(node.type)) add(node.local);
    if (node.type === "CatchClause") add(node.param);
  }
  return names;
}

/** Features by the name under which a script uses them; of a property of who knows what, all that have its name. */
function* featuresOfScript(tree, ownNames, byName) {
  const declared = declaredIn(tree);
  for (const [node, above] of nodesOf(tree)) {
    if (node.type === "Identifier" && !declared.has(node.name)) {
      const isName = (above.property === node || above.key === node) && !above.computed && !above.shorthand;
      const group = GLOBALS.find((names) => Object.hasOwn(names, node.name));
      if (!isName && group) yield [node.name, [group[node.name]]];
    }
    const isMember = node.type === "MemberExpression" && !node.computed;
    const names = isMember ? [node.property.name] : node.type === "ObjectPattern" ? node.properties.map(({ key }) => key?.name) : [];
    for (const name of names.filter(Boolean)) {
      const object = isMember && node.object.type === "Identifier" && !declared.has(node.object.name) ? node.object.name : "";
      const kind = KINDS[object] ?? object;
      const exact = api[kind]?.[name] ?? api[kind]?.[`${name}_static`] ?? javascript.builtins[kind]?.[name];
      if (exact) yield [`${kind}.${name}`, [exact]];
      else if (!ownNames.has(name)) yield [`.${name}`, byName.get(name) ?? []];
    }
  }
}

/** All properties that BCD knows, by name. */
function propertiesByName() {
  const byName = new Map();
  for (const { __compat, ...names } of [...Object.values(api), ...Object.values(javascript.builtins)]) {
    for (const [name, feature] of Object.entries(names)) {
      const plain = name.replace(/_static$/, "");
      byName.set(plain, [...(byName.get(plain) ?? []), feature]);
    }
  }
  return byName;
}

/** What the scripts of some folders use that the oldest browsers lack: by name, who lacks it. */
function lackedByScripts(sources) {
  const trees = sources.map((source) => parse(source, { ecmaVersion: "latest", sourceType: "module" }));
  const ownNames = new Set();
  for (const tree of trees) {
    for (const [node, above] of nodesOf(tree)) {
      const isOwn = /^(Property|PropertyDefinition|MethodDefinition)$/.test(node.type) && above.type !== "ObjectPattern";
      if (isOwn && !node.computed) ownNames.add(node.key.name);
    }
  }
  const byName = propertiesByName();
  const lacked = new Map();
  for (const tree of trees) {
    for (const [name, features] of featuresOfScript(tree, ownNames, byName))
      if (features.length > 0 && features.every((feature) => lacking(feature).length > 0)) lacked.set(name, lacking(features[0]));
  }
  return lacked;
}

test("scripts use nothing newer than the oldest supported browsers, but what they do without", () => {
  const files = [...filesIn("src", ".js"), ...filesIn("demo", ".js")];
  const lacked = lackedByScripts(files.map((file) => readFileSync(join(WWW, file), "utf8")));
  const known = new Set([...Object.keys(DONE_WITHOUT), ...OURS]);
  const unknown = [...lacked].filter(([name]) => !known.has(name)).map(([name, who]) => `${name}: ${who}`);
  assert.deepEqual(unknown, [], "ask whether it is there, do without it, and list it here");
  assert.deepEqual([...known].filter((name) => !lacked.has(name)), [], "listed and not used any more");
});

test("it would be seen", () => {
  const seen = (source) => [...lackedByScripts([source]).keys()];
  assert.deepEqual(seen("const a = Promise.withResolvers();"), ["Promise.withResolvers"]);
  assert.deepEqual(seen("AbortSignal.any([]);"), ["AbortSignal.any"]);
  assert.deepEqual(seen("document.startViewTransition(() => {});"), ["Document.startViewTransition"]);
  assert.deepEqual(seen("element.showPopover(); new URLPattern();"), [".showPopover", "URLPattern"]);
  assert.deepEqual(seen("const { isSubsetOf } = set; const URLPattern = 1; URLPattern;"), [".isSubsetOf"]);
  assert.deepEqual(seen("const list = [3, 1]; list.at(-1); new OffscreenCanvas(1, 1); structuredClone({});"), []);
  assert.deepEqual(lackedByStyles("a { &:hover { color: color-mix(in srgb, red, blue); } b { width: 1cqw } }"), ["nesting", "color-mix()"]);
  assert.deepEqual(lackedByStyles("@starting-style { a { top: anchor(x) } } @supports (top: 1px) { a:popover-open { top: 0 } }").sort(), [
    ...[":popover-open", "@starting-style", "anchor()"],
  ]);
  assert.deepEqual(lackedByPage('<button popovertarget="a">x</button><dialog></dialog><p popover></p>'), ["button popovertarget", "popover"]);
});

/** Of CSS, what old browsers skip: rules and declarations, and what is left then. */
const STYLES_DONE_WITHOUT = {
  ":has": "Firefox 121; buttons that would be hidden stay",
  dvh: "vh is written before it",
  "backdrop-filter": "with its prefix too; else glass is not blurred",
  "user-select": "with its prefix too",
  "text-size-adjust": "with its prefix too",
  "text-wrap": "lines of unequal length",
  "text-wrap: balance": "lines of unequal length",
  "text-wrap: pretty": "lines of unequal length",
  "scrollbar-width": "a bar that scrolls is seen",
  "scrollbar-width: none": "a bar that scrolls is seen",
  "-webkit-tap-highlight-color": "a tap is shown by the browser too",
  ":-moz-progress-bar": "each engine has its own",
  ":-webkit-progress-bar": "each engine has its own",
  ":-webkit-progress-value": "each engine has its own",
  "cursor: default": "phones have no pointer",
  "cursor: grab": "phones have no pointer",
  "cursor: grabbing": "phones have no pointer",
  "cursor: pointer": "phones have no pointer",
};

function lackedByStyles(text) {
  const lacked = new Set();
  const use = (name, feature) => lacking(feature).length > 0 && lacked.add(name);
  postcss.parse(text).walk((node) => {
    if (node.type === "atrule") use(`@${node.name}`, css["at-rules"][node.name]);
    if (node.type === "rule") {
      if (node.parent.type === "rule") use("nesting", css.selectors.nesting);
      for (const [, name] of node.selector.matchAll(/(?<!\\):{1,2}([a-z-]+)/g)) use(`:${name}`, css.selectors[name]);
    }
    if (node.type !== "decl") return;
    const property = css.properties[node.prop];
    use(node.prop, property);
    for (const [word] of node.value.matchAll(/[a-z-]+(?![\w(-])/g)) use(`${node.prop}: ${word}`, property?.[word]);
    for (const [, name] of node.value.matchAll(/([a-z-]+)\(/g))
      use(`${name}()`, css.types[name] ?? Object.values(css.types).find((type) => type[name])?.[name]);
    if (/\d[dls]v[hwib]\b/.test(node.value)) use("dvh", css.types.length.viewport_percentage_units_dynamic);
  });
  return [...lacked];
}

test("styles too", () => {
  const text = [...filesIn("demo", ".css"), ...filesIn("examples", ".css"), ...filesIn("docs", ".css")].map((file) => readFileSync(join(WWW, file), "utf8"));
  const lacked = lackedByStyles(text.join("\n"));
  assert.deepEqual(lacked.sort(), Object.keys(STYLES_DONE_WITHOUT).sort());
});

function lackedByPage(text) {
  const lacked = new Set();
  const names = text.replaceAll(/="[^"]*"/g, '=""');
  for (const [, tag, attributes] of names.matchAll(/<([a-z][a-z0-9]*)((?:\s+[\w-]+(?:="[^"]*")?)*)\s*\/?>/g)) {
    if (lacking(html.elements[tag]).length > 0) lacked.add(tag);
    for (const [, name] of attributes.matchAll(/\s([\w-]+)(?==|\s|$)/g)) {
      if (lacking(html.elements[tag]?.[name]).length > 0) lacked.add(`${tag} ${name}`);
      if (lacking(html.global_attributes[name]).length > 0) lacked.add(name);
    }
  }
  return [...lacked];
}

test("and the page itself", () => {
  // Only iOS needs it.
  assert.deepEqual(lackedByPage(readFileSync(join(WWW, "index.html"), "utf8")), ["video playsinline"]);
});
