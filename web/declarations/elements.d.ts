// The types of `element` and `svg`: the tag decides which element is made and which properties it has.
declare namespace Page {
  type TagOf<Selector extends string> = Selector extends `${infer Tag}.${string}` ? TagOf<Tag> : Selector extends `${infer Tag}#${string}` ? Tag : Selector;
  type ElementOf<Selector extends string> = TagOf<Selector> extends keyof HTMLElementTagNameMap ? HTMLElementTagNameMap[TagOf<Selector>] : HTMLElement;
  type SvgOf<Tag extends string> = Tag extends keyof SVGElementTagNameMap ? SVGElementTagNameMap[Tag] : SVGElement;
  /** Browsers turn numbers into text where a property is text, such as `min` of a slider. */
  type Given<Value> = [Value] extends [string] ? Value | number : Value;
  type Attributes = { role?: string; [name: `${string}-${string}`]: string | number | boolean | null | undefined };
  type Props<Made> = { [Name in keyof Made]?: Given<Made[Name]> | null } & Attributes;
  /** What a worker's `self` has besides what a window has. */
  type Worker = { onmessage: ((event: MessageEvent) => void) | null; postMessage(message: unknown, transfer?: Transferable[]): void };
  type Child = Node | string | null | undefined | false | 0;
}
