export type Vector = ArrayLike<number>;
/** @typedef {ArrayLike<number>} Vector */
/** @param {Vector} a @param {Vector} b */
export declare const dot: (a: Vector, b: Vector) => number;
/** @param {Vector} a @param {Vector} b */
export declare const cross: (a: Vector, b: Vector) => number[];
/** A vector of length 1 in the same direction. @param {readonly number[]} vector */
export declare function unit(vector: readonly number[]): number[];
