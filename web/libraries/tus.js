// Resumable uploads (tus protocol 1.0).
export { Upload } from "tus-js-client";
