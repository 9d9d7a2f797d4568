// The script of Swagger UI, which the service itself has for /docs: as much of it as docs.js uses.
declare const SwaggerUIBundle: {
  (options: { url: string; dom_id: string; presets: unknown[]; deepLinking: boolean; validatorUrl: string | null }): void;
  presets: { apis: unknown };
};
