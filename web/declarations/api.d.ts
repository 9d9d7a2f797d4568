// Short names of what the service answers, for the modules of the page. The shapes come from its OpenAPI document;
// scripts/page-types.py writes them to target/page-types/openapi.d.ts.
declare namespace Api {
  type Schemas = import("/openapi").components["schemas"];
  type Paths = import("/openapi").paths & Files;

  type Footage = Schemas["FootageView"];
  type Library = Schemas["LibraryView"];
  type Flock = Schemas["FlockView"];
  type Fish = Schemas["FishView"];
  type Dataset = Schemas["DatasetView"];
  type Job = Schemas["JobView"];
  type Advice = Schemas["Advice"];
  type FlockParams = Schemas["FlockParams"];
  type AnalysisParams = Schemas["AnalysisParams"];
  type FishParams = Schemas["FishParams"];
  /** Things by the name of their collection under /v1. */
  type Things = { footage: Footage; libraries: Library; flocks: Flock };
  type Goal = Schemas["Goal"];
  type Waypoint = Schemas["Waypoint"];
  type Predator = Schemas["Predator"];
  /** Parameters as a request gives them: those left out have their defaults. */
  type AnalysisChanges = Schemas["AnalysisOverrides"];
  type FlockChanges = Schemas["FlockOverrides"];

  type Method = "get" | "post" | "patch" | "delete";
  /** Whether a path of the page, such as `/v1/jobs/${string}`, is that of the document, such as `/v1/jobs/{id}`. */
  type Fits<Path extends string, Documented extends string> =
    Documented extends `${infer Head}/${infer Rest}`
      ? Path extends `${infer PathHead}/${infer PathRest}` ? FitsPart<PathHead, Head> extends true ? Fits<PathRest, Rest> : false : false
      : Path extends `${string}/${string}` ? false : FitsPart<Path, Documented>;
  type FitsPart<Part, Documented> = Documented extends `{${string}}` ? true : Part extends Documented ? true : false;
  type WithoutQuery<Path extends string> = Path extends `${infer Bare}?${string}` ? Bare : Path;
  /** The operation of the document that a path of the page calls; never if there is none. */
  type Operation<M extends Method, Path extends string> = Path extends string ? {
    [Documented in keyof Paths & string]: Fits<WithoutQuery<Path>, Documented> extends true ? Defined<Paths[Documented], M> : never;
  }[keyof Paths & string] : never;
  type Defined<Item, M extends Method> = Item extends { [method in M]: infer Found } ? Found : never;

  /** All paths of a method, as types of text. */
  type Address<M extends Method> = { [Documented in keyof Paths & string]: [Defined<Paths[Documented], M>] extends [never] ? never : Filled<Documented> | `${Filled<Documented>}?${string}` }[keyof Paths & string];
  type Filled<Documented extends string> = Documented extends `${infer Before}{${string}}${infer After}` ? `${Before}${string}${Filled<After>}` : Documented;

  /** The JSON of a successful response. */
  type Json<M extends Method, Path extends string> = Answer<Operation<M, Path>>;
  type Answer<Operation> = Operation extends { responses: infer Responses } ? Content<Responses[keyof Responses & (200 | 201 | 202)]> : never;
  type Content<Part> = Part extends { content: { "application/json": infer Value } } ? Value : never;
  /** The JSON that a request may have. */
  type Body<M extends Method, Path extends string> = Request<Operation<M, Path>>;
  type Request<Operation> = Operation extends { requestBody?: infer Part } ? Content<Part> : never;
  /** One of the items of a list, and the address of its next page. */
  type Item<Path extends string> = Json<"get", Path> extends { items: (infer One)[] } ? One : never;
  type Next<Path extends string> = `${WithoutQuery<Path>}?${string}` | null;
}
