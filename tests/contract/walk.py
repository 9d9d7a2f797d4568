"""One pass through the whole API, as a client uses it. schemathesis validates each response.

Random requests rarely name existing objects. Here every operation is called for an existing object, from the
upload of a film to the deletion of everything made from it.
"""

import json
from collections import defaultdict

import schemathesis

# An endless stream; tests/it/api/events.rs tests it.
ENDLESS = {"GET /v1/events"}
TUS = {"Tus-Resumable": "1.0.0"}
STREAM, PIECE = "application/octet-stream", "application/offset+octet-stream"
FORM, JSON = "multipart/form-data", "application/json"
CHECKS = ["not_a_server_error", "status_code_conformance", "content_type_conformance",
          "response_headers_conformance", "response_schema_conformance"]


class Walk:
    """Calls operations by name and validates their responses."""

    def __init__(self, address, films, token):
        self.address, self.token = address, token
        # A film that can be analyzed, and one whose background moves.
        self.film, self.moving = (film.read_bytes() for film in films)
        self.document = schemathesis.openapi.from_url(f"{address}/openapi.json")
        self.checks = list(schemathesis.checks.CHECKS.get_by_names(CHECKS))

    def call(self, operation, path=None, body=None, media_type=None, **more):
        """Returns the response, which must be a success that the document describes."""
        method, template = operation.split(" ")
        if body is not None:
            more |= {"body": body, "media_type": media_type or JSON}
        case = self.document[template][method].Case(path_parameters=path or {}, **more)
        answer = case.call_and_validate(base_url=self.address, checks=self.checks, timeout=60)
        assert 200 <= answer.status_code < 300, f"{operation}: {answer.status_code} {answer.text}"
        return answer

    def whole(self):
        self.watch()
        ids = self.make()
        self.refuse()
        self.upload()
        self.read(ids)
        self.sign_in()
        self.delete(ids)

    def watch(self):
        for path in ("/healthz", "/readyz", "/metrics", "/v1/usage"):
            self.call(f"GET {path}")

    def make(self):
        """Creates objects of each kind, by every content type that its operation accepts. Returns ids."""
        footage = self.call("POST /v1/footage", body=self.film, media_type=STREAM).json()["id"]
        same = self.call("POST /v1/footage", body={"video": self.film}, media_type=FORM)
        assert same.status_code == 200 and same.json()["id"] == footage
        poster = self.call("GET /v1/footage/{id}/poster.jpg", {"id": footage}).content
        variant = self.call("POST /v1/footage/{id}/variants", {"id": footage}, body={"background": poster}, media_type=FORM)
        assert variant.json()["id"] != footage
        request = {"footage_id": footage, "params": {"preset": "papers"}}
        self.call("POST /v1/analyses", body=request)
        self.call("POST /v1/analyses", body=self.film, media_type=STREAM)
        analysis = self.call("POST /v1/analyses", body={"video": self.film, "params": "{}"}, media_type=FORM).json()
        library = analysis["library_id"]
        self.wait_for(analysis["job_id"])
        self.call("POST /v1/analyses/preview", body={"footage_id": footage})
        asked = {"library_id": library, "count": 2, "frames": 10}
        self.call("POST /v1/flocks/preview", body=asked)
        flock = self.call("POST /v1/flocks", body=asked).json()
        request = {"footage": self.film, "params": '{"count": 2, "frames": 10}', "analysis": "{}"}
        self.call("POST /v1/flocks", body=request, media_type=FORM)
        fish = self.call("POST /v1/fish", body={"library_id": library}).json()
        self.wait_for(flock["job_id"])
        self.wait_for(fish["job_id"])
        asked = {"library_ids": [library], "flocks": 2, "pictures": 2, "count": [1, 2], "licence": "CC0"}
        self.call("POST /v1/datasets/estimate", body=asked)
        self.call("POST /v1/datasets/preview", body=asked)
        dataset = self.call("POST /v1/datasets", body=asked).json()
        self.wait_for(dataset["job_id"])
        return {"footage": footage, "library": library, "flock": flock["flock_id"], "fish": fish["fish_id"],
                "dataset": dataset["dataset_id"], "job": flock["job_id"]}

    def refuse(self):
        """Analyzes a film that must be refused, and gets the picture of the refusal."""
        job = self.call("POST /v1/analyses", body=self.moving, media_type=STREAM).json()["job_id"]
        refused = self.wait_for(job, "failed")
        assert refused["error"]["picture"], refused
        self.call("GET /v1/jobs/{id}/refused.jpg", {"id": job})

    def wait_for(self, job, state="done"):
        while True:
            answer = self.call("GET /v1/jobs/{id}", {"id": job}, headers={"Prefer": "wait=5"}).json()
            if answer["finished_at"]:
                assert answer["state"] == state, answer
                return answer

    def upload(self):
        self.call("OPTIONS /v1/uploads")
        lengths = TUS | {"Upload-Length": str(len(self.film))}
        made = [self.call("POST /v1/uploads", headers=lengths) for _ in range(2)]
        given_up, whole = [{"id": one.headers["location"][0].rsplit("/", 1)[1]} for one in made]
        self.call("DELETE /v1/uploads/{id}", given_up, headers=TUS)
        half = len(self.film) // 2
        for offset, piece in ((0, self.film[:half]), (half, self.film[half:])):
            asked = self.call("HEAD /v1/uploads/{id}", whole, headers=TUS)
            assert asked.headers["upload-offset"] == [str(offset)]
            at = TUS | {"Upload-Offset": str(offset)}
            self.call("PATCH /v1/uploads/{id}", whole, body=piece, media_type=PIECE, headers=at)

    def read(self, ids):
        for nouns in ("footage", "libraries", "flocks", "fish", "datasets", "jobs"):
            assert self.call(f"GET /v1/{nouns}", query={"limit": 1}).json()["items"]
        for noun, nouns, file in (("library", "libraries", "poses.json"), ("flock", "flocks", "video.mp4"), ("fish", "fish", "model.glb"),
                                 ("dataset", "datasets", "dataset.zip")):
            self.call(f"GET /v1/{nouns}/{{id}}", {"id": ids[noun]})
            self.call(f"GET /v1/{nouns}/{{id}}/{{file}}", {"id": ids[noun], "file": file})
            self.call(f"PATCH /v1/{nouns}/{{id}}", {"id": ids[noun]}, body={"pinned": True})
        self.call("GET /v1/flocks/{id}/school.glb", {"id": ids["flock"]}, query={"body": "goldfish"})
        part = self.call("GET /v1/footage/{id}/file", {"id": ids["footage"]}, headers={"Range": "bytes=0-9"})
        assert part.status_code == 206 and part.content == self.film[:10]
        self.call("GET /v1/footage/{id}", {"id": ids["footage"]})
        self.call("GET /v1/footage/{id}/poster.jpg", {"id": ids["footage"]})
        self.call("PATCH /v1/footage/{id}", {"id": ids["footage"]}, body={"name": "finch.mp4"})
        self.call("GET /v1/errors")
        self.call("GET /v1/jobs/{id}/events", {"id": ids["job"]})
        self.call("POST /v1/flocks/{id}/links", {"id": ids["flock"]}, body={"file": "video.mp4"})

    def sign_in(self):
        begun = self.call("POST /v1/session", body={"token": self.token})
        name, value = begun.headers["set-cookie"][0].split(";")[0].split("=", 1)
        self.call("DELETE /v1/session", cookies={name: value})

    def delete(self, ids):
        # Long enough to be cancelled before it is done.
        asked = {"library_id": ids["library"], "count": 50, "frames": 3000}
        queued = self.call("POST /v1/flocks", body=asked).json()["job_id"]
        self.call("DELETE /v1/jobs/{id}", {"id": queued})
        self.wait_for(queued, "cancelled")
        self.call("POST /v1/jobs/{id}/retry", {"id": queued})
        for noun, nouns in (("dataset", "datasets"), ("fish", "fish"), ("flock", "flocks"), ("library", "libraries"), ("footage", "footage")):
            self.call(f"DELETE /v1/{nouns}/{{id}}", {"id": ids[noun]})


def tell(seen, document):
    """Prints the recorded statuses of every operation. Returns the operations that never succeeded."""
    statuses = defaultdict(set)
    for line in seen.read_text().splitlines():
        operation, status = line.rsplit(" ", 1)
        statuses[operation].add(int(status))
    operations = [f"{method.upper()} {path}" for path, item in document["paths"].items() for method in item]
    print("contract tests: statuses seen")
    for operation in operations:
        print(f"  {operation:36} {' '.join(map(str, sorted(statuses[operation])))}")
    return [one for one in operations if one not in ENDLESS and not any(status < 300 for status in statuses[one])]
