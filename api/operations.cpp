#include "api/operations.h"

#include <array>

#include "api/json/schemas.h"

namespace api {
namespace {

// Headers.
constexpr std::array<std::string_view, 1> kConditional = {"If-None-Match"};
constexpr std::array<std::string_view, 2> kFileHeaders = {"Range", "If-None-Match"};
constexpr std::array<std::string_view, 1> kRangeHeaders = {"Range"};
constexpr std::array<std::string_view, 2> kSubmitHeaders = {"Idempotency-Key", "Prefer"};
constexpr std::array<std::string_view, 1> kBatchHeaders = {"Idempotency-Key"};
constexpr std::array<std::string_view, 1> kPatchHeaders = {"If-Match"};
constexpr std::array<std::string_view, 1> kEventsHeaders = {"Last-Event-ID"};

// Bodies.
/// schema: a name in components/schemas, or JSON text.
constexpr ContentRow json(std::string_view schema) { return {"application/json", schema}; }
constexpr ContentRow bytes(std::string_view media_type) { return {media_type, ""}; }
constexpr ResponseRow answer(int status, std::string_view summary, Rows<ContentRow> content = {}) {
  return {status, summary, content};
}

constexpr std::array kSceneBodies = {
    bytes("model/gltf-binary"), ContentRow{"model/gltf+json", R"({"type":"object"})"},
    bytes("application/zip"),   bytes("application/octet-stream"),
    bytes("model/stl"),         bytes("model/obj"),
    bytes("model/ply"),         bytes("model/3mf"),
    json("SceneFromAssets")};
constexpr std::array kJobBodies = {json("JobRequest"), bytes("image/png"), bytes("image/x-exr")};
constexpr std::array kJobPatch = {json("JobPatch"),
                                  ContentRow{"application/merge-patch+json", "JobPatch"}};
constexpr ContentRow kText = {"text/plain", R"({"type":"string"})"};
constexpr ContentRow kEvents = {
    "text/event-stream",
    R"({"type":"string","x-events":{"snapshot":{"$ref":"#/components/schemas/Job"},)"
    R"("state":{"$ref":"#/components/schemas/StateEvent"},)"
    R"("progress":{"$ref":"#/components/schemas/ProgressEvent"},)"
    R"("tile":{"$ref":"#/components/schemas/TileEvent"},)"
    R"("warning":{"$ref":"#/components/schemas/WarningEvent"},)"
    R"("end":{"$ref":"#/components/schemas/EndEvent"},)"
    R"("reset":{"$ref":"#/components/schemas/ResetEvent"},)"
    R"("overloaded":{"$ref":"#/components/schemas/OverloadedEvent"}}})"};
constexpr std::array kImages = {bytes("image/png"),   bytes("image/jpeg"),
                                bytes("image/webp"),  bytes("image/avif"),
                                bytes("image/x-exr"), bytes("image/vnd.radiance"),
                                bytes("image/tiff"),  bytes("multipart/x-mixed-replace")};

constexpr std::array kPictures = {
    bytes("image/png"),   bytes("image/jpeg"),         bytes("image/webp"), bytes("image/avif"),
    bytes("image/x-exr"), bytes("image/vnd.radiance"), bytes("image/tiff")};
constexpr std::string_view kRenderForm =
    R"({"type":"object","properties":{"scene":{"type":"string","format":"binary",)"
    R"("description":"GLB, glTF or zip; a field of text is an id or a built-in name."},)"
    R"("environment":{"type":"string","format":"binary",)"
    R"("description":"Equirectangular image (.hdr, .exr) that lights the scene."},)"
    R"("file":{"type":"array","items":{"type":"string","format":"binary"},)"
    R"("description":"Files that a glTF or GLB refers to, with their names."},)"
    R"("job":{"$ref":"#/components/schemas/JobRequest"}}})";
constexpr std::string_view kDrakeForm =
    R"({"type":"object","required":["scene","scene_sha256","image_type","width","height",)"
    R"("focal_x","focal_y","center_x","center_y"],"properties":{)"
    R"("scene":{"type":"string","format":"binary","description":"glTF, z up, with its camera."},)"
    R"("scene_sha256":{"type":"string","description":"Of the scene, 64 hexadecimal digits."},)"
    R"("image_type":{"type":"string","enum":["color","depth","label"]},)"
    R"("width":{"type":"integer"},"height":{"type":"integer"},)"
    R"("focal_x":{"type":"number"},"focal_y":{"type":"number"},)"
    R"("center_x":{"type":"number"},"center_y":{"type":"number"},)"
    R"("min_depth":{"type":"number","description":"Metres; of depth images."},)"
    R"("max_depth":{"type":"number","description":"Metres; of depth images."}}})";
constexpr std::array kDrakeImages = {bytes("image/png"), bytes("image/tiff")};
constexpr std::array kRenderBodies = {ContentRow{"multipart/form-data", kRenderForm},
                                      bytes("model/gltf-binary"),
                                      ContentRow{"model/gltf+json", R"({"type":"object"})"},
                                      bytes("application/zip"),
                                      bytes("application/octet-stream"),
                                      json("JobRequest")};

// Responses.
constexpr std::array kPresetMade = {answer(201, "Stored.", json("Preset")),
                                    answer(200, "Replaced.", json("Preset"))};
constexpr std::array kPictureAnswer = {answer(200, "The image.", kPictures),
                                       answer(304, "Unchanged.")};
constexpr std::array kRendered = {
    answer(200, "The image. `Location` is its job.", kPictures),
    answer(202, "The job has not ended in time; its image will be below `Location`.", json("Job"))};
constexpr ResponseRow kTextAnswer = answer(200, "Text.", kText);
constexpr std::array kDocumentAnswer = {answer(200, "The document.", json(R"({"type":"object"})")),
                                        answer(304, "Unchanged.")};
constexpr std::array kPageAnswer = {
    answer(200, "The page.", ContentRow{"text/html", R"({"type":"string"})"}),
    answer(304, "Unchanged.")};
constexpr std::array kAssetMade = {answer(201, "Stored.", json("Asset")),
                                   answer(200, "Already stored.", json("Asset"))};
constexpr std::array kAssetContent = {
    answer(200, "The bytes.", bytes("application/octet-stream")),
    answer(206, "Part of the bytes.", bytes("application/octet-stream")),
    answer(304, "Unchanged.")};
constexpr ResponseRow kGone = answer(204, "Deleted.");
constexpr std::array kSceneMade = {answer(201, "Loaded and stored.", json("Scene")),
                                   answer(200, "Already stored.", json("Scene"))};
constexpr std::array kJobMade = {
    answer(201, "Accepted; with Prefer: wait, the job has ended.", json("Job")),
    answer(202, "The job has not ended within the time of Prefer: wait.", json("Job")),
    answer(200, "A dry run, or the job created earlier with this Idempotency-Key.",
           json(R"({"anyOf":[{"$ref":"#/components/schemas/Job"},)"
                R"({"$ref":"#/components/schemas/DryRun"}]})"))};
constexpr std::array kJobAnswer = {answer(200, "The job.", json("Job")), answer(304, "Unchanged.")};
constexpr ResponseRow kJobChanged = answer(200, "The job after the change.", json("Job"));
constexpr std::array kBatchMade = {
    answer(201, "Accepted.", json("Batch")),
    answer(200, "A dry run, or the batch created earlier with this Idempotency-Key.",
           json(R"({"anyOf":[{"$ref":"#/components/schemas/Batch"},)"
                R"({"$ref":"#/components/schemas/BatchDryRun"}]})"))};
constexpr ResponseRow kBatchAnswer = answer(200, "The batch.", json("Batch"));
constexpr std::array kArchiveAnswer = {answer(200, "The archive.", bytes("application/zip")),
                                       answer(206, "Part of it.", bytes("application/zip")),
                                       answer(304, "Unchanged.")};
constexpr std::array kImageAnswer = {answer(200, "The image.", kImages),
                                     answer(206, "Part of its bytes.", kImages),
                                     answer(304, "Unchanged.")};
constexpr std::array kEventsAnswer = {
    answer(200, "Server-sent events, until the job ends.", kEvents),
    answer(204, "Last-Event-ID was the end event: nothing will follow.")};
constexpr std::array kJobPut = {
    answer(201, "Accepted.", json("Job")),
    answer(200, "The job created earlier by the same request.", json("Job"))};
constexpr std::array kWatchAnswer = {
    answer(200, "Server-sent events of all these jobs, until they have ended.", kEvents),
    answer(204, "Last-Event-ID included the end of every job: nothing will follow.")};
constexpr std::array kTilesAnswer = {
    answer(200, "Tile frames, until the job ends.", bytes("application/vnd.tessera.tiles")),
    answer(204, "The job renders no image (its film is null).")};
constexpr std::array kFilmAnswer = {
    answer(200, "The film.", bytes("application/vnd.tessera.film")),
    answer(206, "Part of it.", bytes("application/vnd.tessera.film")), answer(304, "Unchanged.")};
constexpr std::array kMapAnswer = {answer(200, "The map.", bytes("image/png")),
                                   answer(206, "Part of it.", bytes("image/png")),
                                   answer(304, "Unchanged.")};
constexpr ResponseRow kDrainAnswer = answer(200, "The state of draining.", json("Drain"));
constexpr ResponseRow kWorkDone = answer(204, "Done, by this or an earlier request.");
constexpr ResponseRow kDeliveryBegun =
    answer(202, "The call will be sent at once.", json("Delivery"));
constexpr ResponseRow kSecretAnswer = answer(200, "The secret.", json("WebhookSecret"));

// Problems.
constexpr std::array k400 = {400};
constexpr std::array k404 = {404};
constexpr std::array kCancelProblems = {404, 507};
constexpr std::array kRetryProblems = {404, 409, 507};
constexpr std::array kLabProblems = {400, 413, 415, 422};
constexpr std::array k404Or422 = {404, 422};
constexpr std::array k400Or422 = {400, 422};
constexpr std::array k409Alone = {409};
constexpr std::array kTestProblems = {400, 413, 415, 422, 507};
constexpr std::array kPutProblems = {413, 415, 422, 507};
constexpr std::array kContentProblems = {404, 416};
constexpr std::array kSceneProblems = {400, 404, 413, 415, 422, 424, 507};
constexpr std::array kSubmitProblems = {400, 404, 409, 413, 415, 422, 507};
constexpr std::array kPresetProblems = {400, 409, 413, 415, 422, 507};
constexpr std::array kUrlProblems = {403, 404, 406, 410, 413, 422, 503, 507};
constexpr std::array kRenderProblems = {400, 404, 406, 409, 410, 413, 415, 422, 424, 507};
constexpr std::array kMetricsProblems = {401};
constexpr std::array kSessionProblems = {401, 507};
constexpr std::array kTicketProblems = {400, 404, 415, 422};
constexpr std::array kPatchProblems = {400, 404, 409, 412, 415, 422, 507};
constexpr std::array kExtendProblems = {400, 404, 409, 415, 422, 507};
constexpr std::array kImageProblems = {404, 406, 409, 410, 413, 416, 422};
constexpr std::array kSampledProblems = {404, 409, 410};
constexpr std::array kMergeProblems = {400, 404, 409, 410, 413, 415, 422, 507};
constexpr std::array kFilmProblems = {404, 409, 410, 416};
constexpr std::array kSheetProblems = {404, 416, 422};
constexpr std::array kArchiveProblems = {404, 409, 410, 416, 422, 507};
constexpr std::array kPixelProblems = {404, 409, 410, 422};
constexpr QueryParameters kNoQuery = nullptr;
constexpr Rows<ContentRow> kNoBody = {};

constexpr std::array kOperations = {
    Operation{"getLiveness", "GET", "/livez", "Service", "Liveness check.",
              "Responds even while everything else is busy.", "", kNoBody, kTextAnswer},
    Operation{"getReadiness", "GET", "/readyz", "Service", "Readiness check.",
              "503 while the server is starting or stopping. A line `storage_full: ...` follows "
              "while the disk is full: requests that need space are refused with 507, rendering "
              "jobs pause, and everything else works.",
              "", kNoBody, answer(200, "Ready for work.", kText)},
    Operation{"getMetrics", "GET", "/metrics", "Service", "Prometheus metrics.",
              "If the operator has set `--metrics-key`, it is required as the bearer token.", "",
              kNoBody, kTextAnswer, kMetricsProblems},
    Operation{"getOpenApi", "GET", "/openapi.json", "Service", "This document.", "", "", kNoBody,
              kDocumentAnswer},
    Operation{"getDocs", "GET", "/docs", "Service",
              "This document as a page on which requests can be tried.", "", "", kNoBody,
              kPageAnswer},
    Operation{"getPage", "GET", "/", "Service", "The web page.", "", "", kNoBody, kPageAnswer},
    Operation{"createSession", "POST", "/v1/session", "Service", "Exchange a key for a cookie.",
              "Send the key as the bearer token. The cookie is random, belongs to this browser "
              "alone, and expires after a week or with its key.",
              "", kNoBody, answer(204, "`Set-Cookie` contains the session."), kSessionProblems},
    Operation{"deleteSession", "DELETE", "/v1/session", "Service", "End the session of the cookie.",
              "", "", kNoBody, answer(204, "The session has ended.")},
    Operation{"getServer", "GET", "/v1/server", "Service", "Server capabilities.",
              "Version, build, limits, and all names that a job can use.", "read", kNoBody,
              answer(200, "Server capabilities.", json("Server"))},
    Operation{"getDrain", "GET", "/v1/drain", "Service", "Get whether the server is draining.", "",
              "admin", kNoBody, kDrainAnswer},
    Operation{
        "startDrain", "PUT", "/v1/drain", "Service", "Drain the server.",
        "Refuses new jobs with 503; running jobs continue, queued ones wait. Ends on restart.",
        "admin", kNoBody, kDrainAnswer},
    Operation{"endDrain", "DELETE", "/v1/drain", "Service", "Accept jobs again.", "", "admin",
              kNoBody, kDrainAnswer},
    Operation{"createAsset", "POST", "/v1/assets", "Assets", "Upload a file.",
              "Raw bytes of any file. The id is the sha256 of the content. 422 for an image that "
              "is cut short or damaged, and for other content with an `image/` type.",
              "write", bytes("application/octet-stream"), kAssetMade, kPutProblems},
    Operation{"putAsset", "PUT", "/v1/assets/{sha256}", "Assets", "Upload a file under its hash.",
              "422 if the content has a different hash, or for an image that is cut short or "
              "damaged, or other content with an `image/` type.",
              "write", bytes("application/octet-stream"), kAssetMade, kPutProblems},
    Operation{"getAsset", "GET", "/v1/assets/{sha256}", "Assets", "Download a file.",
              "Immutable; may be cached indefinitely.", "read", kNoBody, kAssetContent,
              kContentProblems, kNoQuery, kFileHeaders},
    Operation{"deleteAsset", "DELETE", "/v1/assets/{sha256}", "Assets", "Delete a file.",
              "409 while a scene or job uses it.", "write", kNoBody, kGone, kRetryProblems},
    Operation{"createScene", "POST", "/v1/scenes", "Scenes", "Upload a scene.",
              "A GLB, a glTF without other files, a zip, or asset ids. GLB and zip are recognized "
              "by their first bytes, whatever type is given. Other formats, named by their type "
              "(`model/stl`) or by `name`, are converted; 415 where the server cannot. All files "
              "that it refers to are required; 424 lists missing ones.",
              "write", kSceneBodies, kSceneMade, kSceneProblems, &scene_upload_parameters},
    Operation{"listScenes", "GET", "/v1/scenes", "Scenes", "List scenes.", "", "read", kNoBody,
              answer(200, "Scenes, newest first.", json("SceneList")), k400,
              &scene_list_parameters},
    Operation{"getScene", "GET", "/v1/scenes/{id}", "Scenes", "Describe a scene.", "", "read",
              kNoBody, answer(200, "The scene.", json("Scene")), k404},
    Operation{"deleteScene", "DELETE", "/v1/scenes/{id}", "Scenes", "Delete a scene.",
              "409 if a job uses it.", "write", kNoBody, kGone, kRetryProblems},
    Operation{"getSceneGltf", "GET", "/v1/scenes/{id}/gltf", "Scenes",
              "Download a built-in scene as GLB.", "", "read", kNoBody,
              answer(200, "The scene as GLB.", bytes("model/gltf-binary")), k404},
    Operation{
        "render", "POST", "/v1/render", "Jobs", "Render a scene and get the image.",
        "One request for upload, job and image. The scene is the body, the part `scene` of a form, "
        "or named by the parameter `scene` or the job. Other files of a form are `environment`, "
        "`file` (files that a glTF refers to, found by their names or the last part of them) and "
        "`job` (a JobRequest); fields of text are parameters, as in the query, which is merged "
        "into the job. png, jpg, webp and avif are exposed automatically, or for the light of a "
        "preset, unless `exposure` is given. The same request again gets the image of the first "
        "one's job. If the client of a job's first request leaves before it is answered, the job "
        "is cancelled, unless another request has asked for the same.",
        "write", kRenderBodies, kRendered, kRenderProblems, &render_parameters},
    Operation{"renderDrake", "POST", "/v1/drake/render", "Jobs",
              "Render for Drake's MakeRenderEngineGltfClient.",
              "Drake's glTF render protocol; with `tessera serve --drake` also at `/render`. "
              "color: a PNG, rendered as by POST /v1/render, whose query parameters apply and "
              "belong to the client's render_endpoint; without preset, the light is `tent`. depth: "
              "a TIFF of one float per pixel, metres along the camera's axis, infinite from "
              "max_depth on, 0 up to min_depth. label: a PNG of the materials' base colours, white "
              "where there is nothing. Depths and labels are those of the surface at the pixel's "
              "centre. The scene and the job are deleted once they are answered.",
              "write", ContentRow{"multipart/form-data", kDrakeForm},
              answer(200, "The image.", kDrakeImages), kRenderProblems, &render_parameters},
    Operation{"createJob", "POST", "/v1/jobs", "Jobs", "Submit a job.",
              "Only `scene` is required. Unknown members are refused.", "write", kJobBodies,
              kJobMade, kSubmitProblems, &submit_parameters, kSubmitHeaders},
    Operation{"putJob", "PUT", "/v1/jobs/{id}", "Jobs", "Submit a job with a client-chosen id.",
              "The id is a UUID. The same body again: 200 and no second job; another body: 409.",
              "write", json("JobRequest"), kJobPut, kSubmitProblems},
    Operation{"listJobs", "GET", "/v1/jobs", "Jobs", "List jobs.", "", "read", kNoBody,
              answer(200, "Jobs, newest first.", json("JobList")), k400, &job_list_parameters},
    Operation{"getJob", "GET", "/v1/jobs/{id}", "Jobs", "Get a job, or wait for it to finish.", "",
              "read", kNoBody, kJobAnswer, k404Or422, &wait_parameters, kConditional},
    Operation{"patchJob", "PATCH", "/v1/jobs/{id}", "Jobs", "Change a job.",
              "A merge patch (RFC 7396) of priority, labels, name, stop and paused.", "write",
              kJobPatch, kJobChanged, kPatchProblems, kNoQuery, kPatchHeaders},
    Operation{"cancelJob", "POST", "/v1/jobs/{id}/cancel", "Jobs", "Cancel a job.",
              "Keeps the image so far. Cancelling twice is not an error.", "write", kNoBody,
              kJobChanged, kCancelProblems},
    Operation{"retryJob", "POST", "/v1/jobs/{id}/retry", "Jobs", "Retry a failed or doubted job.",
              "A failed one continues from its last complete checkpoint, if any; a finished one "
              "that is `doubted` begins again. 409 for others, for `merged` ones, and if the scene "
              "was deleted.",
              "write", kNoBody, answer(202, "The job is queued again.", json("Job")),
              kRetryProblems},
    Operation{"extendJob", "POST", "/v1/jobs/{id}/extend", "Jobs", "Extend a finished job.", "",
              "write", json("ExtendRequest"), answer(202, "The job resumes.", json("Job")),
              kExtendProblems},
    Operation{"deleteJob", "DELETE", "/v1/jobs/{id}", "Jobs", "Delete a job and its files.",
              "409 while it runs.", "write", kNoBody, kGone, kRetryProblems},
    Operation{"putPreset", "PUT", "/v1/presets/{name}", "Presets", "Store a preset.",
              "A job template for POST /v1/render?preset=NAME and for images by URL. Names are the "
              "tenant's own; those of studio lights are taken. A job that places the camera is "
              "refused, since the angles are those of the URL. Caches that hold an image of an "
              "older preset keep it: give a changed preset another name.",
              "write", json("PresetRequest"), kPresetMade, kPresetProblems},
    Operation{"listPresets", "GET", "/v1/presets", "Presets", "List the presets.",
              "With the ready ones: hero, packshot, turntable and thumbnail. A preset stored under "
              "such a name replaces it.",
              "read", kNoBody, answer(200, "The presets.", json("PresetList"))},
    Operation{"getPreset", "GET", "/v1/presets/{name}", "Presets", "Get a preset.", "", "read",
              kNoBody, answer(200, "The preset.", json("Preset")), k404},
    Operation{"deletePreset", "DELETE", "/v1/presets/{name}", "Presets", "Delete a preset.",
              "Its URLs are 404 from then on; jobs of its images remain.", "write", kNoBody, kGone,
              k404},
    Operation{"createSigningKey", "POST", "/v1/signing-keys", "Presets",
              "Make a key that signs URLs of images.",
              "It signs for its tenant: the tenant's presets, scenes and quotas. The key is shown "
              "only once.",
              "write", kNoBody, answer(201, "The key.", json("SigningKey")), k409Alone},
    Operation{"listSigningKeys", "GET", "/v1/signing-keys", "Presets", "List the signing keys.",
              "Without their texts.", "write", kNoBody,
              answer(200, "The keys.", json("SigningKeyList"))},
    Operation{"deleteSigningKey", "DELETE", "/v1/signing-keys/{id}", "Presets",
              "Delete a signing key.", "URLs that it signed are 403 from then on.", "write",
              kNoBody, kGone, k404},
    Operation{"getPicture", "GET", "/i/{signature}/{preset}/{scene}/{view}", "Presets",
              "Get an image by its URL.",
              "Needs no key, and pages of all origins may use it. Each distinct image is one job "
              "of the preset's tenant, for all clients. Until the job ends, answers are the image "
              "as it is after the preset's `deadline_seconds`, with `Cache-Control: no-store`, or "
              "503 if some pixel has no sample yet, the server is busy, or as many jobs as URLs "
              "may start (`url_jobs_of_a_preset`, `url_jobs_of_a_key` of the limits) have not "
              "ended; the final image is `immutable`. If the job fails, the answer is its reason, "
              "with `Retry-After`, and it is not tried again for five minutes.",
              "", kNoBody, kPictureAnswer, kUrlProblems, &picture_url_parameters, kConditional},
    Operation{"createBatch", "POST", "/v1/batches", "Batches", "Submit jobs that vary a template.",
              "Creates all jobs or none. Jobs with the same scene share it in "
              "memory.",
              "write", json("BatchRequest"), kBatchMade, kSubmitProblems, &batch_submit_parameters,
              kBatchHeaders},
    Operation{"listBatches", "GET", "/v1/batches", "Batches", "List batches.",
              "A batch is deleted with its last job.", "read", kNoBody,
              answer(200, "Batches, newest first.", json("BatchList")), k400,
              &batch_list_parameters},
    Operation{"getBatch", "GET", "/v1/batches/{id}", "Batches", "Get a batch.", "", "read", kNoBody,
              kBatchAnswer, k404},
    Operation{"cancelBatch", "POST", "/v1/batches/{id}/cancel", "Batches",
              "Cancel the unfinished jobs.", "", "write", kNoBody, kBatchAnswer, kCancelProblems},
    Operation{"retryBatch", "POST", "/v1/batches/{id}/retry", "Batches",
              "Retry the failed and doubted jobs.",
              "As by POST /v1/jobs/{id}/retry. 409 when there are none.", "write", kNoBody,
              answer(202, "The jobs are queued again.", json("Batch")), kRetryProblems},
    Operation{"deleteBatch", "DELETE", "/v1/batches/{id}", "Batches",
              "Delete a batch and its jobs.", "409 while one of its jobs is active.", "write",
              kNoBody, kGone, kRetryProblems},
    Operation{"getBatchArchive", "GET", "/v1/batches/{id}/archive.zip", "Batches",
              "Download the images of a batch.",
              "A zip with one file for each job that has an image. 409 while a job has not ended; "
              "410, with the names, if films were evicted. Has a length, and honours Range, up to "
              "100 megapixels of images; larger archives are sent while they are made.",
              "read", kNoBody, kArchiveAnswer, kArchiveProblems, &archive_parameters, kFileHeaders},
    Operation{"getBatchSheet", "GET", "/v1/batches/{id}/sheet.png", "Batches",
              "Get the images of a batch on one sheet.",
              "In the order of the jobs, row by row; white where there is no image yet.", "read",
              kNoBody, answer(200, "The sheet.", bytes("image/png")), kSheetProblems,
              &sheet_parameters, kRangeHeaders},
    Operation{"getImage", "GET", "/v1/jobs/{id}/image{.format}", "Results",
              "Get the rendered image (partial while the job is running).",
              "The format follows from the extension (png, jpg, webp, avif, exr, hdr, tif) or from "
              "Accept.",
              "read", kNoBody, kImageAnswer, kImageProblems, &image_parameters, kFileHeaders},
    Operation{"getPixel", "GET", "/v1/jobs/{id}/pixels/{x}/{y}", "Results",
              "Get one pixel with its intervals.", "", "read", kNoBody,
              answer(200, "The pixel.", json("Pixel")), kPixelProblems},
    Operation{"getConvergence", "GET", "/v1/jobs/{id}/convergence", "Results",
              "Get the error over samples and time.", "", "read", kNoBody,
              answer(200, "The curve.", json("Convergence")), k404},
    Operation{"getMeter", "GET", "/v1/jobs/{id}/meter", "Results",
              "Get the irradiance at the meter's points.",
              "409 before every point has a sample; 404 for a job without a meter.", "read",
              kNoBody, answer(200, "The readings.", json("Meter")), kSampledProblems},
    Operation{"getMeterTable", "GET", "/v1/jobs/{id}/meter.csv", "Results",
              "Get the irradiance as CSV.", "", "read", kNoBody,
              answer(200, "The readings as a table.", bytes("text/csv")), kSampledProblems},
    Operation{"getObjects", "GET", "/v1/jobs/{id}/objects", "Results",
              "Get the meaning of layer ids.",
              "409 before the first sample; 404 also if the scene was deleted.", "read", kNoBody,
              answer(200, "The ids.", json("SceneObjects")), kSampledProblems},
    Operation{
        "getFilm", "GET", "/v1/jobs/{id}/film", "Results", "Download the film (raw sample sums).",
        "Only for jobs that have ended. Little endian; `TSRFILM1`, u32 bytes of head, ledger and "
        "text, u32 bytes of the text, u32 ranges, u32 flags, i32 full width, full height, crop x, "
        "y, width, height, u32 replicates, u32 tiles, u64 bytes of the file, sha256 of the content "
        "(hex). Flags: 1 auxiliary values, 2 errors of neighbours are correlated, 4 splats, 8 "
        "depths along the camera's axis, 16 mattes of objects, 32 of materials, 64 errors are of "
        "the image over white, 128 first hits; from bit 8 on the number of shares of the light, in "
        "the order of the spec's layers. Then 24 bytes per range of samples: u64 seed, u32 first "
        "replicate, replicates, samples, 0. Then the text (JSON: spec, build, error, warnings), "
        "zeros up to a multiple of 8. With flag 4 u64 light paths of each replicate, rejected "
        "splats, rays of light paths. Then the tiles, of 32 x 32 pixels from the full film's "
        "origin on, clipped to the crop: i32 x, y, u32 samples, 0, u64 rejected samples, rays, f64 "
        "CPU seconds; for each pixel and replicate f32 mean r, g, b, alpha, M2 of the luminance, "
        "u32 count; with flag 1 for each pixel f32 albedo, normal, depth, u32 hits; with flag 4 "
        "for each pixel and replicate, and then the same for each share, i128 sums r, g, b of "
        "splats in units of 2^-40; for each pixel, replicate and share f32 mean r, g, b; with flag "
        "128 for each pixel u32 object, instance, material, primitive, f32 position, u, v, motion; "
        "for each pixel and each of flags 16 and 32 six times u32 id, u32 samples of half A, of "
        "half B; with flag 8 for each pixel f32 depth. Finally the sha256 (hex) of everything "
        "before.",
        "read", kNoBody, kFilmAnswer, kFilmProblems, kNoQuery, kFileHeaders},
    Operation{
        "mergeFilms", "POST", "/v1/films/merge", "Results", "Merge films.",
        "Films of jobs that have ended, or film files uploaded as assets. Their jobs may differ "
        "only in seed, replicates, stop rules and names (422). Common samples are refused (409). "
        "Replicates are put side by side: jobs that hold replicates 0 to 1 and 2 to 3 of a seed "
        "give the film of the one job with four, bit for bit (auxiliary layers to rounding); other "
        "seeds count as further independent replicates. The weights are the sample counts.",
        "write", json("MergeRequest"),
        answer(201, "A finished job with the merged film.", json("Job")), kMergeProblems},
    Operation{"streamEvents", "GET", "/v1/jobs/{id}/events", "Streams", "Watch a job.",
              "Events: snapshot, state, progress, tile, warning, end; reset after a loss; "
              "overloaded at the limit of streams.",
              "read", kNoBody, kEventsAnswer, k404, &job_events_parameters, kEventsHeaders},
    Operation{"watchJobs", "GET", "/v1/events", "Streams", "Watch several jobs on one connection.",
              "The events of each job, with `job` in their data.", "read", kNoBody, kWatchAnswer,
              k404Or422, &events_parameters, kEventsHeaders},
    Operation{"createStreamTicket", "POST", "/v1/stream-tickets", "Streams",
              "Create a short-lived stream ticket (valid for one minute).",
              "Added as `?ticket=` to events, tiles or image, it replaces the key, which pages "
              "cannot send with an EventSource or an image.",
              "read", json("TicketRequest"),
              answer(201, "A ticket that is valid for one minute.", json("Ticket")),
              kTicketProblems},
    Operation{"streamTiles", "GET", "/v1/jobs/{id}/tiles", "Streams", "Stream tiles.",
              "Frames, little endian: `T S R 1`, u32 payload bytes, u32 revision, u16 x, y, width, "
              "height, u32 flags, f32 relative error, u32 CRC-32 of the payload; then planes of "
              "float32, r g b, their variances, the sample count. Flag 1: end frame; 2: correlated "
              "errors (zsobol, restir); 4: an alpha plane comes last; 8: planes of float16, r g b "
              "only, at most 65504 (planes=mean); 16: denoised (`?denoise=`): r g b, alpha by 4.",
              "read", kNoBody, kTilesAnswer, k404Or422, &tiles_parameters},
    Operation{"createComparison", "POST", "/v1/comparisons", "Results", "Compare two images.",
              "Two jobs that have ended, or a job and an uploaded image (8 and 16 bits are read as "
              "sRGB, as this server writes them with `curve=srgb`, floats as linear; it counts as "
              "exact except for its rounding). b is the reference. The interval of the bias comes "
              "from the halves of both, and for a job whose pixels have correlated errors (zsobol, "
              "restir) from the means of its replicates (with two of them it is wide); z is the "
              "difference of the luminances in standard errors, pooled over 3 x 3 pixels. Both "
              "assume that the two are independent, which jobs with a common seed are not.",
              "write", json("ComparisonRequest"),
              answer(201, "The comparison.", json("Comparison")), kMergeProblems},
    Operation{"compareMeters", "GET", "/v1/comparisons", "Results",
              "Compare the meters of two jobs.",
              "At each point the difference a - b with its interval, as if the two were "
              "independent. 409 if their points differ, or one has no reading yet.",
              "read", kNoBody, answer(200, "The comparison.", json("MeterComparison")),
              kPixelProblems, &meter_comparison_parameters},
    Operation{"getComparison", "GET", "/v1/comparisons/{id}", "Results", "Get a comparison.", "",
              "read", kNoBody, answer(200, "The comparison.", json("Comparison")), k404},
    Operation{"getComparisonMap", "GET", "/v1/comparisons/{id}/{map}", "Results",
              "Get a comparison image (difference, z or FLIP).",
              "`difference.png`: blue where a is darker, red where it is brighter; the root of |a "
              "- b| / sqrt(b^2 + 0.01). `z.png`: the same colours from -5 to 5 standard errors. "
              "`flip.png`: 0 black to 1 pale yellow.",
              "read", kNoBody, kMapAnswer, kContentProblems, kNoQuery, kFileHeaders},
    Operation{
        "runExperiment", "POST", "/v1/lab/runs", "Laboratory", "Run an experiment.",
        "Runs trials with the renderer's own classes at each n. The same request gives the same "
        "lines, except for `seconds` and `efficiency`, which are measured. Closing the connection "
        "cancels the run. 429 while `lab_runs` others run, or `lab_runs_of_a_key` of the same key.",
        "write", json("LabRequest"),
        answer(200, "JSON lines: a LabPoint for each completed n, then a LabOutcome.",
               ContentRow{"application/x-ndjson",
                          R"({"anyOf":[{"$ref":"#/components/schemas/LabPoint"},)"
                          R"({"$ref":"#/components/schemas/LabOutcome"},)"
                          R"({"$ref":"#/components/schemas/LabCancelled"}]})"}),
        kLabProblems},
    Operation{"listDeliveries", "GET", "/v1/webhooks/deliveries", "Webhooks", "List webhook calls.",
              "Pending calls and, for a week, earlier ones.", "read", kNoBody,
              answer(200, "Calls, newest first.", json("DeliveryList")), k400Or422,
              &delivery_list_parameters},
    Operation{"getDelivery", "GET", "/v1/webhooks/deliveries/{id}", "Webhooks",
              "Get a webhook call.", "", "read", kNoBody,
              answer(200, "The call.", json("Delivery")), k404},
    Operation{"redeliver", "POST", "/v1/webhooks/deliveries/{id}/redeliver", "Webhooks",
              "Repeat a webhook call.", "At once, with the same id and body, in any state.",
              "write", kNoBody, kDeliveryBegun, k404},
    Operation{"testWebhook", "POST", "/v1/webhooks/test", "Webhooks", "Send a test call.",
              "One signed call of type `test`, without retries; its delivery reports the outcome.",
              "write", json("WebhookTestRequest"), kDeliveryBegun, kTestProblems},
    Operation{"getWebhookSecret", "GET", "/v1/webhooks/secret", "Webhooks",
              "Get the signing secret.",
              "Each tenant has its own. Calls are signed as defined by Standard Webhooks 1.0.",
              "write", kNoBody, kSecretAnswer},
    Operation{"replaceWebhookSecret", "POST", "/v1/webhooks/secret", "Webhooks",
              "Create a new signing secret.",
              "For all later calls. 409 for the operator's, which is set by a flag or a file.",
              "write", kNoBody, kSecretAnswer, k409Alone},
    Operation{"listKeys", "GET", "/v1/keys", "Keys", "List the keys.", "Without their texts.",
              "admin", kNoBody, answer(200, "The keys.", json("KeyList"))},
    Operation{"createKey", "POST", "/v1/keys", "Keys", "Create a key.",
              "403 on a server without keys: create the first one with `tessera keys add`.",
              "admin", json("KeyRequest"),
              answer(201, "The key, with its text.", json("IssuedKey")), kTestProblems},
    Operation{"deleteKey", "DELETE", "/v1/keys/{id}", "Keys", "Remove a key.",
              "It stops working within a second; objects created with it stay with its tenant.",
              "admin", kNoBody, kGone, k404},
    Operation{"listWorkers", "GET", "/v1/workers", "Workers", "List the workers.", "", "read",
              kNoBody, answer(200, "The workers.", json("WorkerList"))},
    Operation{"listWorkerTiles", "GET", "/v1/jobs/{id}/workers", "Workers",
              "List the workers' tiles.", "Tiles of the job that are being rendered.", "read",
              kNoBody, answer(200, "The tiles.", json("WorkerTiles")), k404},
    Operation{"reportWorker", "PUT", "/v1/workers/{id}", "Workers", "Report a worker's state.", "",
              "worker", json("WorkerReport"),
              answer(200, "Orders for the worker.", json("WorkerOrders")), kSubmitProblems},
    Operation{"getWorkInputs", "GET", "/v1/work/jobs/{id}", "Workers", "Get a job's inputs.",
              "404 without open units.", "worker", kNoBody,
              answer(200, "The inputs.", json("WorkInputs")), k404},
    Operation{"getWorkFile", "GET", "/v1/work/jobs/{id}/files/{sha256}", "Workers",
              "Get an input file.", "", "worker", kNoBody, kAssetContent, kContentProblems},
    Operation{"leaseUnit", "POST", "/v1/work/units/{id}/lease", "Workers", "Lease a unit.", "",
              "worker", json("UnitRequest"),
              answer(200, "The unit's slices.", bytes("application/octet-stream")),
              kSubmitProblems},
    Operation{"putUnitResult", "PUT", "/v1/work/units/{id}/results/{worker}", "Workers",
              "Send the result of a unit.", "422 if it cannot be the unit's result.", "worker",
              bytes("application/octet-stream"), kWorkDone, kSubmitProblems},
    Operation{"handBackUnit", "POST", "/v1/work/units/{id}/hand-back", "Workers", "Return a unit.",
              "", "worker", json("UnitRequest"), kWorkDone, kSubmitProblems},
    Operation{
        "getUsage", "GET", "/v1/usage", "Keys", "Get the usage of tenants.",
        "All tenants for the operator and keys with scope `admin`; otherwise only the key's own.",
        "read", kNoBody, answer(200, "The usage.", json("Usage"))}};

}  // namespace

std::span<const Operation> operations() { return kOperations; }

}  // namespace api
