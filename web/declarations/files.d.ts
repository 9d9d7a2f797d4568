// The fields that the page reads of the JSON files of a library and of a flock (docs/reference/formats.md). The OpenAPI
// document has no schema of a file.
declare namespace Api {
  type JsonFile<Content> = { get: { responses: { 200: { content: { "application/json": Content } } } } };
  interface Files {
    "/v1/libraries/{id}/library.json": JsonFile<LibraryFile>;
    "/v1/libraries/{id}/poses.json": JsonFile<PosesFile>;
    "/v1/libraries/{id}/summary.json": JsonFile<SummaryFile>;
    "/v1/flocks/{id}/flock.json": JsonFile<FlockFile>;
    "/openapi.json": JsonFile<{ components: { schemas: Record<string, JsonSchema> } }>;
  }

  interface LibraryFile {
    clip_frames: number;
    natural_step: number;
    stats: LibraryStats;
    transitions: { from: number; to: number; mirrored: boolean; distance: number }[];
    /** Frame, next frame, cost, and whether the mirror side changes. */
    playback: [number, number, number, boolean?][];
    component: number[];
    patches?: { start: number; end: number }[];
  }
  interface LibraryStats {
    heading_histogram?: number[];
    speed_bl_per_s?: number[] | null;
    first_foreign_s?: number | null;
    n_foreign_frames?: number;
    disturbances?: { kind: string; from_s: number; to_s: number }[];
    kappa_used?: number | null;
  }

  type SummaryFile = Record<
    "px_per_cm" | "distance_bl" | "distance_cm" | `${"mean" | "median" | "peak"}_speed_${"bl" | "cm"}_per_s` | "rest_s" | "n_rest_bouts" | "turns_per_min",
    number | null
  >;

  interface Pose {
    frame: number;
    time_s: number;
    detected: boolean;
    cut: boolean;
    confidence: number | null;
    head_confidence: number | null;
    centroid_px: number[] | null;
    box_px: number[] | null;
    heading_rad: number | null;
    length_px: number | null;
    height_px: number | null;
    midline_px: number[][] | null;
    bend_rad: number | null;
  }
  interface PosesHead {
    view: "side" | "top";
    view_confidence?: number;
    other_movers?: Mover[];
    camera: Schemas["CameraParams"] | null;
    tail_beat: { spans: { frames: number[]; frequency_hz: number }[] } | null;
  }
  type PosesFile = PosesHead & { frames: Pose[] };
  interface Mover {
    kind: string;
    from_s: number;
    to_s: number;
    box_px: number[];
  }

  interface AtlasFile {
    schema: string;
    frame: number[];
    center_px: number[][];
    sheets: AtlasSheet[];
  }
  interface AtlasSheet {
    scale: number;
    pages: { file: string; size_px: number[] }[];
    page: number[];
    x: number[];
    y: number[];
    w: number[];
    h: number[];
  }

  interface FlockFile {
    fps: number;
    individuals: Individual[];
  }
  interface Individual {
    id: number;
    source_frame: number[];
    mirrored: boolean[];
    heading_rad: number[];
    boid: { heading_rad: number[] };
  }
  /** Head of flock.plan. */
  interface PlanHead {
    schema: string;
    fps: number;
    image_size_px: number[];
    length_px: number;
    n_frames: number;
    n_individuals: number;
    individuals: { id: number; size: number }[];
    fades: { individual: number; start: number; n: number; mirrored: boolean }[];
    columns: { name: string; type: string; scale: number; n: number; at: number }[];
    predator: number[][];
    params: FlockParams;
    stats: FlockStats;
    advice?: Advice[];
  }
  /** Numbers by name, of which these are given special words; and the same for each frame. */
  type FlockStats = { per_frame?: Record<string, number[]> } & Record<FlockFigure, number>;
  type FlockFigure = "polarization" | "milling" | "spacing_bl" | "nearest_neighbor_bl" | "clone_share" | "room_for" | "distinct_looks" | "wall_violations";

  /** A schema of the OpenAPI document, as far as settings are read from it. */
  interface JsonSchema {
    $ref?: string;
    type?: string | string[];
    oneOf?: JsonSchema[];
    anyOf?: JsonSchema[];
    allOf?: JsonSchema[];
    properties?: Record<string, JsonSchema>;
    items?: JsonSchema;
    minItems?: number;
    enum?: (string | null)[];
    default?: unknown;
    description?: string;
    minimum?: number;
    exclusiveMinimum?: number;
    maximum?: number;
    exclusiveMaximum?: number;
    multipleOf?: number;
  }
}
