// Files that people give: chosen, or dropped onto the page, those of a folder too.

/**
 * @param {HTMLInputElement} input
 * @param {(files: File[]) => void} take is given what was chosen, the same files again too
 */
export function onChosen(input, take) {
  input.addEventListener("change", () => {
    const files = [...(input.files ?? [])];
    input.value = "";
    if (files.length > 0) take(files);
  });
}

/** @param {DataTransfer | null} dropped */
export async function droppedFiles(dropped) {
  // All of it is asked for at once: after the event nothing is there any more.
  const entries = [...(dropped?.items ?? [])].map((item) => item.webkitGetAsEntry());
  const alone = [...(dropped?.files ?? [])];
  if (!entries.some((entry) => entry?.isDirectory)) return alone;
  const files = await Promise.all(entries.map((entry) => (entry ? filesOf(entry) : [])));
  return files.flat();
}

/** @param {FileSystemEntry} entry @returns {Promise<File[]>} those that can be read */
async function filesOf(entry) {
  if (entry.isFile) return new Promise((resolve) => /** @type {FileSystemFileEntry} */ (entry).file((file) => resolve([file]), () => resolve([])));
  const reader = /** @type {FileSystemDirectoryEntry} */ (entry).createReader();
  const files = [];
  // Browsers give some of a folder at a time.
  for (;;) {
    const entries = await new Promise((/** @type {(some: FileSystemEntry[]) => void} */ resolve) => reader.readEntries(resolve, () => resolve([])));
    if (entries.length === 0) return files;
    files.push(...(await Promise.all(entries.map(filesOf))).flat());
  }
}
