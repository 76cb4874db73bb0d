import type { MeshTopology, SourcedCamera, SurfaceMesh } from "../index.js";
import type { TemplateLight } from "./template-light.js";
/** What is seen divided by what is printed, both the mean of the faces around a vertex and of those around its neighbours. */
export declare class VertexLight {
    #private;
    /**
     * @param {MeshTopology} mesh
     * @param {TemplateLight} template
     */
    constructor({ faces, textureCoordinates }: MeshTopology, template: TemplateLight);
    /**
     * @param {SurfaceMesh["vertices"]} vertices
     * @param {Float32Array} seen fraction of each vertex's surroundings that nothing covers
     * @param {SourcedCamera} camera
     * @param {{ data: Uint8ClampedArray, width: number, height: number }} frame RGBA, small: each pixel the mean of those it stands for
     * @returns {Float32Array} linear light on each vertex, 1 where the image is as bright as the print
     */
    of(vertices: SurfaceMesh["vertices"], seen: Float32Array, camera: SourcedCamera, frame: {
        data: Uint8ClampedArray;
        width: number;
        height: number;
    }): Float32Array;
}
