// How large a picture is in print: usual sizes, lengths as people write them.

/** @typedef {"mm" | "cm"} Unit */
/** @typedef {"a4" | "a5" | "postcard" | "card"} UsualSize */

/** Longer and shorter side, mm. @type {Readonly<Record<UsualSize, readonly [number, number]>>} */
export const USUAL_SIZES = { a4: [297, 210], a5: [210, 148], postcard: [148, 105], card: [85.6, 54] };

/** Shortest and longest side of a print that a camera can see whole and still tell its details, mm. */
export const MIN_MM = 20;
export const MAX_MM = 3000;

/**
 * A length that someone typed.
 *
 * @param {string} text such as "148", "14,8", "14.8 cm"
 * @param {Unit} unit where the text names none
 * @returns {number} mm; NaN where it is no length
 */
export function parseLength(text, unit) {
  const match = /^\s*(\d+(?:[.,]\d*)?|[.,]\d+)\s*(mm|cm)?\s*$/i.exec(text);
  if (!match) return Number.NaN;
  return Number(match[1].replace(",", ".")) * ((match[2]?.toLowerCase() ?? unit) === "cm" ? 10 : 1);
}

/**
 * @param {number} mm
 * @param {Unit} unit
 * @returns {string} without the unit, to the tenth of a millimetre below 100 mm and to the millimetre from there on
 */
export function formatLength(mm, unit) {
  const rounded = mm < 100 ? Math.round(10 * mm) / 10 : Math.round(mm);
  return String(unit === "cm" ? Math.round(10 * rounded) / 100 : rounded);
}

/**
 * @param {number} widthMm
 * @param {number} heightMm
 * @param {Unit} [unit]
 */
export function formatSize(widthMm, heightMm, unit = "mm") {
  return `${formatLength(widthMm, unit)} × ${formatLength(heightMm, unit)} ${unit}`;
}

/**
 * The largest print of some proportions on a sheet of a usual size, which lies as the picture does.
 *
 * @param {UsualSize} usual
 * @param {number} aspect width over height of the picture
 */
export function largestOn(usual, aspect) {
  const [width, height] = layOut(usual, aspect);
  return width / height < aspect
    ? { widthMm: width, heightMm: width / aspect }
    : { widthMm: height * aspect, heightMm: height };
}

/**
 * The sheet itself, upright for upright pictures.
 *
 * @param {UsualSize} usual
 * @param {number} aspect
 * @returns {readonly [number, number]} width and height, mm
 */
export function layOut(usual, aspect) {
  const [long, short] = USUAL_SIZES[usual];
  return aspect < 1 ? [short, long] : [long, short];
}

/** @param {number} mm */
export function isUsableLength(mm) {
  return mm >= MIN_MM && mm <= MAX_MM;
}
