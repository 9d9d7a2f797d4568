//! A sender of resumable uploads (tus 1.0.0). Every function takes the URL of the service, because an upload may go on at
//! another one.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use reqwest::{Method, RequestBuilder, Response, StatusCode};
use tokio::io::AsyncWriteExt;
use tokio::net::TcpStream;

use super::client;

pub(crate) fn request(base: &str, method: &str, path: &str) -> RequestBuilder {
    let method = Method::from_bytes(method.as_bytes()).unwrap();
    let request = client().request(method, format!("{base}{path}"));
    request.header("tus-resumable", "1.0.0")
}

/// Creates an upload and returns its path.
pub(crate) async fn begin(base: &str, size_bytes: usize) -> String {
    let label = STANDARD.encode("../my fish.mp4");
    let answer = request(base, "POST", "/v1/uploads")
        .header("upload-length", size_bytes)
        .header(
            "upload-metadata",
            format!("filename {label},filetype dmlkZW8="),
        );
    let answer = answer.send().await.unwrap();
    assert_eq!(answer.status(), StatusCode::CREATED);
    assert!(header(&answer, "upload-expires").ends_with(" GMT"));
    header(&answer, "location")
}

pub(crate) fn header(answer: &Response, name: &str) -> String {
    answer.headers()[name].to_str().unwrap().to_owned()
}

/// Returns a request that sends the bytes from `offset` on.
pub(crate) fn piece(base: &str, path: &str, offset: usize, bytes: &[u8]) -> RequestBuilder {
    request(base, "PATCH", path)
        .header("content-type", "application/offset+octet-stream")
        .header("upload-offset", offset)
        .body(bytes.to_vec())
}

/// Returns the number of bytes that the service has confirmed.
pub(crate) async fn offset(base: &str, path: &str) -> usize {
    let answer = request(base, "HEAD", path).send().await.unwrap();
    assert_eq!(answer.status(), StatusCode::OK);
    assert_eq!(header(&answer, "cache-control"), "no-store");
    header(&answer, "upload-offset").parse().unwrap()
}

/// Sends the head of a PATCH for the bytes `at..all`, then only `some` bytes. Returns the open connection.
pub(crate) async fn send_some(
    base: &str,
    path: &str,
    at: usize,
    all: usize,
    some: &[u8],
) -> TcpStream {
    let authority = base.replace("http://", "");
    let mut connection = TcpStream::connect(&authority).await.unwrap();
    let head = format!(
        "PATCH {path} HTTP/1.1\r\nhost: {authority}\r\ntus-resumable: 1.0.0\r\nupload-offset: {at}\r\n\
         content-type: application/offset+octet-stream\r\ncontent-length: {}\r\n\r\n",
        all - at
    );
    connection.write_all(head.as_bytes()).await.unwrap();
    connection.write_all(some).await.unwrap();
    connection.flush().await.unwrap();
    connection
}

/// Returns the path of the footage that the answer names.
pub(crate) fn footage(answer: &Response) -> String {
    let link = header(answer, "link");
    link.split(['<', '>']).nth(1).unwrap().to_owned()
}
