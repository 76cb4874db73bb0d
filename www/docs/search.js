// Looks for words in the pages of the documentation. `search.json`, which the site has beside it, holds each section's place, title and text.

const MOST = 12;
const input = document.querySelector("input[type=search]");
const list = document.querySelector("#sections");
let sections;

input.addEventListener("input", async () => {
  sections ??= fetch("search.json").then((response) => response.json());
  const words = input.value.toLowerCase().split(/\s+/).filter(Boolean);
  const found = words.length === 0 ? [] : (await sections).map((section) => [rank(section, words), section]).filter(([rank]) => rank > 0);
  const best = found.sort(([a], [b]) => b - a).slice(0, MOST);
  list.replaceChildren(...best.map(([, { href, page, title }]) => {
    const link = Object.assign(document.createElement("a"), { href, textContent: page === title ? title : `${page}: ${title}` });
    const item = document.createElement("li");
    item.append(link);
    return item;
  }));
  if (words.length > 0 && best.length === 0) list.append(Object.assign(document.createElement("li"), { textContent: "Nothing has all of these words." }));
});

/** How often a section has the words, those of its title more; 0 where one is missing. */
function rank({ page, title, text }, words) {
  const counts = words.map((word) => {
    const count = (where) => where.toLowerCase().split(word).length - 1;
    return 20 * count(title) + 5 * count(page) + count(text);
  });
  return counts.includes(0) ? 0 : counts.reduce((sum, count) => sum + Math.log1p(count), 0);
}
