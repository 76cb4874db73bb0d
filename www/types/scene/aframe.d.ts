import { Scene } from "three";
import type { Object3D, WebGLRenderer } from "three";
export type Entity = HTMLElement & {
    object3D: Object3D;
    sceneEl: SceneElement;
    emit: (name: string, detail: unknown, bubbles: boolean) => void;
    setObject3D: (name: string, object: Object3D) => void;
    components: Record<string, any>;
};
export type SceneElement = Entity & {
    object3D: Scene;
    renderer: WebGLRenderer;
    camera: Object3D & {
        el: Entity;
    };
    systems: Record<string, any>;
    renderStarted: boolean;
    render: (time: number, frame?: XRFrame) => void;
};
