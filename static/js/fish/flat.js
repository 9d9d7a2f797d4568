// The film of the virtual fish, in step with the other one, for browsers without WebGL 2.
// @ts-check
import { element, releaseVideo } from "../app/element.js";
import { say } from "../app/words.js";

/** Time by which it may run ahead or behind while it plays, s. */
const LOOSE_S = 0.1;

/** @param {{id: string, fps: number, size: number[], life: AbortSignal}} options */
export function createFlat({ id, fps, size, life }) {
  const video = element("video", { src: `/v1/fish/${id}/video.mp4`, muted: true, playsInline: true, loop: true, preload: "auto", tabIndex: -1, "aria-label": say("fish.film.label") });
  const node = element("div.stage", { "data-look": "film" }, video);
  node.style.aspectRatio = size.join(" / ");
  let [frame, isSeeking, sought] = [0, false, -1];
  const seek = () => {
    if (isSeeking || video.readyState < 1 || sought === frame) return;
    [isSeeking, sought] = [true, frame];
    video.currentTime = (frame + 0.5) / fps;
  };
  video.addEventListener("seeked", () => { isSeeking = false; if (video.paused) seek(); }, { signal: life });
  video.addEventListener("loadedmetadata", seek, { signal: life });
  life.addEventListener("abort", () => releaseVideo(video));
  return {
    node, controls: element("p.soft", {}, say("fish.no_webgl")),
    setFrame(/** @type {number} */ next) {
      frame = next;
      if (video.paused || Math.abs(video.currentTime - frame / fps) > LOOSE_S) { sought = -1; seek(); }
    },
    setPlaying(/** @type {boolean} */ isPlaying) { if (isPlaying) video.play().catch(() => {}); else { video.pause(); sought = -1; seek(); } },
  };
}
