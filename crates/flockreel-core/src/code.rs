//! All stable error codes, each with a one-sentence meaning and advice. The same codes appear in the API, on
//! the command line, in the database and in the documentation. A code is never renamed and never changes its
//! meaning.

macro_rules! codes {
    ($($variant:ident $name:literal $meaning:literal $advice:literal)*) => {
        /// A stable error code. [`Code::meaning`] explains it and [`Code::advice`] says what to do.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
        pub enum Code { $(#[doc = $meaning] $variant,)* }

        impl Code {
            /// All codes, in the order of this file.
            pub const ALL: &'static [Code] = &[$(Code::$variant,)*];

            /// Returns the stable name, in snake case.
            pub fn name(self) -> &'static str {
                match self { $(Code::$variant => $name,)* }
            }

            /// Returns the meaning, one sentence for users.
            pub fn meaning(self) -> &'static str {
                match self { $(Code::$variant => $meaning,)* }
            }

            /// Returns the advice to the user who got the error.
            pub fn advice(self) -> &'static str {
                match self { $(Code::$variant => $advice,)* }
            }

            /// Returns the code with the given name; `None` if there is none.
            pub fn from_name(name: &str) -> Option<Code> {
                match name { $($name => Some(Code::$variant),)* _ => None }
            }
        }
    };
}

codes! {
    // Input files (docs/explanation/promises.md, "Bad input").
    NotAVideo "not_a_video" "The file is not a video that can be read."
        "Send a video file: MP4, MOV, 3GP, MKV, WebM, AVI, MPEG, MPEG-TS, ASF, WMV, FLV, OGV, H.264, H.265, or an \
         animated GIF, PNG or WebP. A playlist is not a video. Send still pictures as a zip of numbered PNG, JPEG, BMP, \
         WebP or TIFF files, or as one TIFF with several pages; the command line also takes a folder."
    ContainerNotAllowed "container_not_allowed" "The container format is not supported."
        "Convert it, for example with `ffmpeg -i film -an -c:v libx264 -crf 16 converted.mp4`."
    CodecNotAllowed "codec_not_allowed" "The video codec is not supported."
        "Convert it, for example with `ffmpeg -i film -an -c:v libx264 -crf 16 converted.mp4`."
    TooManyPixels "too_many_pixels" "The picture is larger than the limit."
        "Scale it down, for example with `ffmpeg -i film -an -vf scale=1920:-2 -c:v libx264 -crf 16 smaller.mp4`."
    TooFewPixels "too_few_pixels" "The picture is smaller than the limit."
        "Film at a higher resolution: each side of the picture needs at least 16 pixels."
    TooManyFrames "too_many_frames" "The footage has more frames than the limit."
        "Send a part of the film, for example with `ffmpeg -i film -an -frames:v 20000 -c:v libx264 -crf 16 piece.mp4`."
    TooManyStreams "too_many_streams" "The file holds more streams (picture, sound, subtitles) than the limit."
        "Send only the video stream, for example with `ffmpeg -i film -an -sn -dn -c:v libx264 -crf 16 film-alone.mp4`."
    TooLong "too_long" "The footage lasts longer than the limit."
        "Send a part of the film, for example with `ffmpeg -i film -an -t 600 -c:v libx264 -crf 16 piece.mp4`. To \
         measure a whole time lapse, set a higher frame rate, such as 30."
    TooFast "too_fast" "The frame rate is above the limit."
        "Reduce the frame rate, for example with `ffmpeg -i film -an -r 60 -c:v libx264 -crf 16 slower.mp4`, or set \
         the true frame rate, such as 240."
    Truncated "truncated" "The file is incomplete or damaged."
        "Copy the file from the camera again. If no complete copy exists, the message of the error says what else helps: \
         it depends on the missing part."
    Encrypted "encrypted" "The video is encrypted."
        "Send it without copy protection."
    NoVideoStream "no_video_stream" "The file holds no video stream."
        "The file may contain only sound. Send a file with a video stream."
    TooFewFrames "too_few_frames" "The footage has too few frames to analyze."
        "Film for longer. An analysis needs at least 16 frames; half a minute or more is recommended."
    TimeLimit "time_limit" "Processing exceeded its time limit."
        "Send a shorter film or one with fewer pixels, or request fewer individuals or frames."
    MemoryLimit "memory_limit" "Processing exceeded its memory limit."
        "Send a shorter film or one with fewer pixels, or request fewer individuals or frames."
    DecoderCrashed "decoder_crashed" "The video decoder or encoder stopped unexpectedly."
        "Convert the film with `ffmpeg -i film -an -c:v libx264 -crf 16 converted.mp4` and try again. If the error \
         returns, report it to the operator of the service."
    StorageFull "storage_full" "The disk has too little free space."
        "Delete results that are no longer needed, or ask the operator of the service for more disk space. Then try \
         again."
    OwnerStorageFull "owner_storage_full" "Your stored files and open uploads have reached the limit of their space."
        "Delete films, libraries, flocks or virtual fish that are no longer needed, or cancel open uploads; `GET /v1/usage` \
         shows how much space each kind takes. Or ask the operator of the service for a higher limit (`--max-owner-bytes`)."
    // Analysis (docs/explanation/algorithms.md, "Refused footage").
    NothingMoves "nothing_moves" "No moving animal was found in the film."
        "Film an animal that moves and that differs from the background in color or brightness. Or send a picture of \
         the empty scene, or lower the threshold."
    NothingAtPoint "nothing_at_point" "No moving object was found at the point `animal_at`."
        "Choose a frame in which the animal has moved, and a point on the animal. Frames count from 0, as in \
         poses.json."
    MasksDiffer "masks_differ" "The masks do not match the footage in size or number."
        "Send one mask per frame, with the width and height of the footage. If the frame rate of the footage varies, \
         set a rate, such as 30; each picture is then used once."
    MasksEmpty "masks_empty" "The masks show no animal."
        "Send masks that are white on the animal and black elsewhere."
    BackgroundNotStatic "background_not_static" "Large parts of the picture change during the whole film."
        "Use a tripod, fix zoom and focus, and film a still scene. Or ignore the part of the picture that moves, or \
         measure a steady part of the film."
    CameraMoved "camera_moved" "The camera moved too often: it kept no position for long enough."
        "Measure a part of the film with a still camera, or film again with the camera fixed."
    LightChanges "light_changes" "The light changes too often or too strongly to be corrected."
        "Measure a part with steady light, or film in steady light. Set the \
         anti-flicker mode of the camera to the mains frequency, 50 or 60 Hz."
    SceneChanges "scene_changes" "The film shows several scenes, none of them for long enough."
        "Measure only the scene that shows the animal."
    AnimalTooLarge "animal_too_large" "The animal fills too much of the picture."
        "Step back, or zoom out, until the animal covers less than 15 % of the picture. Or send masks of the animal."
    SeveralAnimals "several_animals" "More than one animal moves in the footage."
        "Film a single animal, without its mirror image. Or point at the animal in one frame, or follow the \
         largest."
    AnimalTooSmall "animal_too_small" "The animal is too small in the picture."
        "Film from a shorter distance, or at a higher resolution."
    BackgroundSizeDiffers "background_size_differs" "The size of the background image differs from that of the footage."
        "Send a background with the width and height of the film, or none."
    // Flocks.
    NoTransitions "no_transitions" "The footage has too few similar moments for endless playback."
        "Film for longer, so that the animal returns to similar poses."
    StaysInPlace "stays_in_place" "The animal stays at one place in the film, so all of a flock would be there."
        "Film the animal while it moves about. Or ask for a flock of one, or for `position: boid`, which moves it as no \
         film shows it."
    // All jobs and uploads.
    InputFailed "input_failed" "The film or library for this job is missing: it was deleted, or the job that should \
                                have made it failed or was cancelled."
        "Follow the advice of that job, or send the film again. Then repeat the request."
    CrashedWorker "crashed_worker" "The job probably caused three crashes, and is not tried again automatically."
        "Try other parameters or another film, and report the error to the operator of the service. After the operator \
         has removed the cause, `POST /v1/jobs/{id}/retry` starts the job again."
    AlreadyStored "already_stored" "The same film is stored already."
        "Use the stored footage; `GET /v1/footage` lists it."
    InvalidParams "invalid_params" "A parameter is unknown, malformed or out of its range."
        "The message names the parameter and the fault. The API reference at `/docs` lists all ranges and defaults."
    Cancelled "cancelled" "The job was cancelled."
        "Repeat the request if the result is still needed."
    // The API.
    NotFound "not_found" "No resource exists at this address."
        "Check the address. The object may have been deleted, or may belong to another owner."
    NotReady "not_ready" "The result does not exist yet: its job has not finished."
        "Wait for the job in `detail`, through its events or with `Prefer: wait=60`."
    Making "making" "The file does not exist yet: a job is making it."
        "Wait for the job in `detail`, through its events or with `Prefer: wait=60`, or repeat the request after the \
         seconds of `Retry-After`."
    MethodNotAllowed "method_not_allowed" "The method is not allowed for this address."
        "The `Allow` header of the response lists the allowed methods."
    MalformedRequest "malformed_request" "The request is malformed."
        "`detail` names the fault. Compare the request with the API reference at `/docs`."
    UnsupportedMediaType "unsupported_media_type" "The media type of the body is not supported at this address."
        "Set `Content-Type` as in the API reference, and send no `Content-Encoding`."
    TooLarge "too_large" "The body is larger than the limit."
        "Send a smaller body. The operator of the service sets the limit for films."
    HeadTooLarge "head_too_large" "The header of the request exceeds the limit."
        "Send fewer or shorter header fields. The limit is 32 KiB in total."
    AddressTooLong "address_too_long" "The address is longer than the limit."
        "Send a shorter address. The limit is 8 KiB."
    BodyTimeout "body_timeout" "The body arrived too slowly."
        "Use a faster network, or upload the film in parts through `/v1/uploads`."
    BodyCutOff "body_cut_off" "The body ended before it was complete."
        "Send the body again. Uploads through `/v1/uploads` continue where they were interrupted."
    RangeNotSatisfiable "range_not_satisfiable" "The requested range begins after the end of the file."
        "`Content-Range` in the response contains the size of the file."
    PreconditionFailed "precondition_failed" "`If-Match` names another version than the current one."
        "Get the resource again, and repeat the request with its `ETag`, or without `If-Match`. Writes accept only `*`."
    AlreadyFinished "already_finished" "The job has ended and cannot be cancelled."
        "No action is needed. Delete the result if it is not needed."
    RetryRefused "retry_refused" "The job cannot be tried again."
        "`detail` names the reason. Only a job that was cancelled, crashed or exceeded a limit can be tried again."
    IdempotencyKeyReused "idempotency_key_reused" "The Idempotency-Key was already used with another body."
        "Use a new key for a new request."
    RequestInProgress "request_in_progress" "The first request with this Idempotency-Key is still being processed."
        "Wait for the time in `Retry-After`, then repeat the same request."
    OffsetDiffers "offset_differs" "`Upload-Offset` differs from the stored offset of the upload."
        "Read the stored `Upload-Offset` with HEAD, and continue from there."
    ChecksumMismatch "checksum_mismatch" "The checksum of the received bytes differs from `Upload-Checksum`."
        "Send the same part again."
    TusVersionNotSupported "tus_version_not_supported" "Tus-Resumable must be 1.0.0."
        "Send `Tus-Resumable: 1.0.0` with every request to `/v1/uploads`."
    Unauthenticated "unauthenticated" "The request needs a valid token. The token is missing, unknown, expired or \
                                       revoked."
        "Send `Authorization: Bearer TOKEN`, or sign in on the page; `flockreel token create` makes tokens."
    ScopeTooSmall "scope_too_small" "The scope of the token does not allow this request."
        "Use a token with a larger scope. The scopes are read, write and admin."
    QuotaExceeded "quota_exceeded" "The token has reached its quota of queued and running jobs."
        "Wait until a job ends, or cancel one."
    QueueFull "queue_full" "The queue has reached its limit of queued and running jobs."
        "Wait for the time in `Retry-After`, then repeat the request. Uploaded films are kept."
    Busy "busy" "The service is too busy to answer this request."
        "Wait for the time in `Retry-After`, then repeat the request. Bytes received through `/v1/uploads` are kept."
    RateLimited "rate_limited" "The client sent too many requests in a short time."
        "Wait for the time in `Retry-After`. Follow jobs through `/v1/events` instead of polling."
    CrossSite "cross_site" "The request comes from another site, or names a host that the service does not accept."
        "Open the page of the service at its own address, or use a client that sends no `Origin`."
    Stopping "stopping" "The service is stopping and accepts no new work."
        "Repeat the request after the restart. Accepted uploads and jobs are kept."
    Internal "internal" "An internal error occurred in flockreel."
        "Try again. If the error returns, report the `x-request-id` of the response to the operator of the service."
}

impl std::fmt::Display for Code {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_code_is_found_by_its_name() {
        for &code in Code::ALL {
            assert_eq!(Code::from_name(code.name()), Some(code));
        }
    }
}
