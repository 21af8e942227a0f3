#include "api/operations.h"

#include <array>

#include "api/json/schemas.h"

namespace api {
namespace {

using Headers = std::span<const std::string_view>;
using Contents = std::span<const ContentRow>;

// Headers.
constexpr std::array<std::string_view, 1> kConditional = {"If-None-Match"};
constexpr std::array<std::string_view, 2> kFileHeaders = {"Range", "If-None-Match"};
constexpr std::array<std::string_view, 1> kRangeHeaders = {"Range"};
constexpr std::array<std::string_view, 2> kSubmitHeaders = {"Idempotency-Key", "Prefer"};
constexpr std::array<std::string_view, 1> kBatchHeaders = {"Idempotency-Key"};
constexpr std::array<std::string_view, 1> kPatchHeaders = {"If-Match"};
constexpr std::array<std::string_view, 1> kEventsHeaders = {"Last-Event-ID"};

// Bodies.
constexpr std::array kBytes = {ContentRow{"application/octet-stream", ""}};
constexpr std::array kSceneBodies = {ContentRow{"model/gltf-binary", ""},
                                     ContentRow{"model/gltf+json", R"({"type":"object"})"},
                                     ContentRow{"application/zip", ""},
                                     ContentRow{"application/octet-stream", ""},
                                     ContentRow{"model/stl", ""},
                                     ContentRow{"model/obj", ""},
                                     ContentRow{"model/ply", ""},
                                     ContentRow{"model/3mf", ""},
                                     ContentRow{"application/json", "SceneFromAssets"}};
constexpr std::array kGlb = {ContentRow{"model/gltf-binary", ""}};
constexpr std::array kJobRequest = {ContentRow{"application/json", "JobRequest"}};
constexpr std::array kJobBodies = {ContentRow{"application/json", "JobRequest"},
                                   ContentRow{"image/png", ""}, ContentRow{"image/x-exr", ""}};
constexpr std::array kJobPatch = {ContentRow{"application/json", "JobPatch"},
                                  ContentRow{"application/merge-patch+json", "JobPatch"}};
constexpr std::array kBatchBody = {ContentRow{"application/json", "BatchRequest"}};
constexpr std::array kBatch = {ContentRow{"application/json", "Batch"}};
constexpr std::array kBatchOrDryRun = {
    ContentRow{"application/json", R"({"anyOf":[{"$ref":"#/components/schemas/Batch"},)"
                                   R"({"$ref":"#/components/schemas/BatchDryRun"}]})"}};
constexpr std::array kBatchList = {ContentRow{"application/json", "BatchList"}};
constexpr std::array kZip = {ContentRow{"application/zip", ""}};
constexpr std::array kExtend = {ContentRow{"application/json", "ExtendRequest"}};
constexpr std::array kMerge = {ContentRow{"application/json", "MergeRequest"}};
constexpr std::array kComparisonRequest = {ContentRow{"application/json", "ComparisonRequest"}};
constexpr std::array kTicketRequest = {ContentRow{"application/json", "TicketRequest"}};
constexpr std::array kTicket = {ContentRow{"application/json", "Ticket"}};
constexpr std::array kLabRequest = {ContentRow{"application/json", "LabRequest"}};
constexpr std::array kKeyRequest = {ContentRow{"application/json", "KeyRequest"}};
constexpr std::array kKeyList = {ContentRow{"application/json", "KeyList"}};
constexpr std::array kIssuedKey = {ContentRow{"application/json", "IssuedKey"}};
constexpr std::array kDrain = {ContentRow{"application/json", "Drain"}};
constexpr std::array kWorkerReport = {ContentRow{"application/json", "WorkerReport"}};
constexpr std::array kWorkerOrders = {ContentRow{"application/json", "WorkerOrders"}};
constexpr std::array kWorkerList = {ContentRow{"application/json", "WorkerList"}};
constexpr std::array kWorkerTiles = {ContentRow{"application/json", "WorkerTiles"}};
constexpr std::array kUnitRequest = {ContentRow{"application/json", "UnitRequest"}};
constexpr std::array kInputs = {ContentRow{"application/json", "WorkInputs"}};
constexpr std::array kUsage = {ContentRow{"application/json", "Usage"}};
constexpr std::array kDelivery = {ContentRow{"application/json", "Delivery"}};
constexpr std::array kDeliveryList = {ContentRow{"application/json", "DeliveryList"}};
constexpr std::array kWebhookTest = {ContentRow{"application/json", "WebhookTestRequest"}};
constexpr std::array kWebhookSecret = {ContentRow{"application/json", "WebhookSecret"}};
constexpr std::array kText = {ContentRow{"text/plain", R"({"type":"string"})"}};
constexpr std::array kHtml = {ContentRow{"text/html", R"({"type":"string"})"}};
constexpr std::array kAnyJson = {ContentRow{"application/json", R"({"type":"object"})"}};
constexpr std::array kServer = {ContentRow{"application/json", "Server"}};
constexpr std::array kAsset = {ContentRow{"application/json", "Asset"}};
constexpr std::array kScene = {ContentRow{"application/json", "Scene"}};
constexpr std::array kSceneList = {ContentRow{"application/json", "SceneList"}};
constexpr std::array kJob = {ContentRow{"application/json", "Job"}};
constexpr std::array kJobOrDryRun = {ContentRow{"application/json",
                                                R"({"anyOf":[{"$ref":"#/components/schemas/Job"},)"
                                                R"({"$ref":"#/components/schemas/DryRun"}]})"}};
constexpr std::array kJobList = {ContentRow{"application/json", "JobList"}};
constexpr std::array kPixel = {ContentRow{"application/json", "Pixel"}};
constexpr std::array kMeterComparison = {ContentRow{"application/json", "MeterComparison"}};
constexpr std::array kMeter = {ContentRow{"application/json", "Meter"}};
constexpr std::array kCsv = {ContentRow{"text/csv", ""}};
constexpr std::array kConvergence = {ContentRow{"application/json", "Convergence"}};
constexpr std::array kObjects = {ContentRow{"application/json", "SceneObjects"}};
constexpr std::array kComparison = {ContentRow{"application/json", "Comparison"}};
constexpr std::array kFilm = {ContentRow{"application/vnd.tessera.film", ""}};
constexpr std::array kEvents = {
    ContentRow{"text/event-stream",
               R"({"type":"string","x-events":{"snapshot":{"$ref":"#/components/schemas/Job"},)"
               R"("state":{"$ref":"#/components/schemas/StateEvent"},)"
               R"("progress":{"$ref":"#/components/schemas/ProgressEvent"},)"
               R"("tile":{"$ref":"#/components/schemas/TileEvent"},)"
               R"("warning":{"$ref":"#/components/schemas/WarningEvent"},)"
               R"("end":{"$ref":"#/components/schemas/EndEvent"},)"
               R"("reset":{"$ref":"#/components/schemas/ResetEvent"},)"
               R"("overloaded":{"$ref":"#/components/schemas/OverloadedEvent"}}})"}};
constexpr std::array kTiles = {ContentRow{"application/vnd.tessera.tiles", ""}};
constexpr std::array kPng = {ContentRow{"image/png", ""}};
constexpr std::array kLines = {ContentRow{"application/x-ndjson",
                                          R"({"anyOf":[{"$ref":"#/components/schemas/LabPoint"},)"
                                          R"({"$ref":"#/components/schemas/LabOutcome"},)"
                                          R"({"$ref":"#/components/schemas/LabCancelled"}]})"}};
constexpr std::array kImages = {
    ContentRow{"image/png", ""},   ContentRow{"image/jpeg", ""},
    ContentRow{"image/webp", ""},  ContentRow{"image/avif", ""},
    ContentRow{"image/x-exr", ""}, ContentRow{"image/vnd.radiance", ""},
    ContentRow{"image/tiff", ""},  ContentRow{"multipart/x-mixed-replace", ""}};

constexpr std::array kPictures = {
    ContentRow{"image/png", ""},   ContentRow{"image/jpeg", ""},
    ContentRow{"image/webp", ""},  ContentRow{"image/avif", ""},
    ContentRow{"image/x-exr", ""}, ContentRow{"image/vnd.radiance", ""},
    ContentRow{"image/tiff", ""}};
constexpr std::array kPresetBody = {ContentRow{"application/json", "PresetRequest"}};
constexpr std::array kPreset = {ContentRow{"application/json", "Preset"}};
constexpr std::array kPresetList = {ContentRow{"application/json", "PresetList"}};
constexpr std::array kSigningKey = {ContentRow{"application/json", "SigningKey"}};
constexpr std::array kSigningKeyList = {ContentRow{"application/json", "SigningKeyList"}};
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
constexpr std::array kDrakeBodies = {ContentRow{"multipart/form-data", kDrakeForm}};
constexpr std::array kDrakeImages = {ContentRow{"image/png", ""}, ContentRow{"image/tiff", ""}};
constexpr std::array kRenderBodies = {ContentRow{"multipart/form-data", kRenderForm},
                                      ContentRow{"model/gltf-binary", ""},
                                      ContentRow{"model/gltf+json", R"({"type":"object"})"},
                                      ContentRow{"application/zip", ""},
                                      ContentRow{"application/octet-stream", ""},
                                      ContentRow{"application/json", "JobRequest"}};

// Responses.
constexpr Contents kNothing = {};
constexpr std::array kPresetMade = {ResponseRow{201, "Stored.", kPreset},
                                    ResponseRow{200, "Replaced.", kPreset}};
constexpr std::array kPresetAnswer = {ResponseRow{200, "The preset.", kPreset}};
constexpr std::array kPresetListAnswer = {ResponseRow{200, "The presets.", kPresetList}};
constexpr std::array kSigningKeyListAnswer = {ResponseRow{200, "The keys.", kSigningKeyList}};
constexpr std::array kSigningKeyMade = {ResponseRow{201, "The key.", kSigningKey}};
constexpr std::array kPictureAnswer = {ResponseRow{200, "The image.", kPictures},
                                       ResponseRow{304, "Unchanged.", kNothing}};
constexpr std::array kRendered = {
    ResponseRow{200, "The image. `Location` is its job.", kPictures},
    ResponseRow{202, "The job has not ended in time; its image will be below `Location`.", kJob}};
constexpr std::array kDrakeAnswer = {ResponseRow{200, "The image.", kDrakeImages}};
constexpr std::array kTextAnswer = {ResponseRow{200, "Text.", kText}};
constexpr std::array kReadyAnswer = {ResponseRow{200, "Ready for work.", kText}};
constexpr std::array kDocumentAnswer = {ResponseRow{200, "The document.", kAnyJson},
                                        ResponseRow{304, "Unchanged.", kNothing}};
constexpr std::array kPageAnswer = {ResponseRow{200, "The page.", kHtml},
                                    ResponseRow{304, "Unchanged.", kNothing}};
constexpr std::array kServerAnswer = {ResponseRow{200, "Server capabilities.", kServer}};
constexpr std::array kAssetMade = {ResponseRow{201, "Stored.", kAsset},
                                   ResponseRow{200, "Already stored.", kAsset}};
constexpr std::array kAssetContent = {ResponseRow{200, "The bytes.", kBytes},
                                      ResponseRow{206, "Part of the bytes.", kBytes},
                                      ResponseRow{304, "Unchanged.", kNothing}};
constexpr std::array kGone = {ResponseRow{204, "Deleted.", kNothing}};
constexpr std::array kSessionMade = {
    ResponseRow{204, "`Set-Cookie` contains the session.", kNothing}};
constexpr std::array kSessionEnded = {ResponseRow{204, "The session has ended.", kNothing}};
constexpr std::array kSceneMade = {ResponseRow{201, "Loaded and stored.", kScene},
                                   ResponseRow{200, "Already stored.", kScene}};
constexpr std::array kSceneListAnswer = {ResponseRow{200, "Scenes, newest first.", kSceneList}};
constexpr std::array kSceneAnswer = {ResponseRow{200, "The scene.", kScene}};
constexpr std::array kGlbAnswer = {ResponseRow{200, "The scene as GLB.", kGlb}};
constexpr std::array kJobMade = {
    ResponseRow{201, "Accepted; with Prefer: wait, the job has ended.", kJob},
    ResponseRow{202, "The job has not ended within the time of Prefer: wait.", kJob},
    ResponseRow{200, "A dry run, or the job created earlier with this Idempotency-Key.",
                kJobOrDryRun}};
constexpr std::array kJobListAnswer = {ResponseRow{200, "Jobs, newest first.", kJobList}};
constexpr std::array kJobAnswer = {ResponseRow{200, "The job.", kJob},
                                   ResponseRow{304, "Unchanged.", kNothing}};
constexpr std::array kJobChanged = {ResponseRow{200, "The job after the change.", kJob}};
constexpr std::array kJobExtended = {ResponseRow{202, "The job resumes.", kJob}};
constexpr std::array kJobRetried = {ResponseRow{202, "The job is queued again.", kJob}};
constexpr std::array kBatchMade = {
    ResponseRow{201, "Accepted.", kBatch},
    ResponseRow{200, "A dry run, or the batch created earlier with this Idempotency-Key.",
                kBatchOrDryRun}};
constexpr std::array kBatchAnswer = {ResponseRow{200, "The batch.", kBatch}};
constexpr std::array kBatchRetried = {ResponseRow{202, "The jobs are queued again.", kBatch}};
constexpr std::array kBatchListAnswer = {ResponseRow{200, "Batches, newest first.", kBatchList}};
constexpr std::array kArchiveAnswer = {ResponseRow{200, "The archive.", kZip},
                                       ResponseRow{206, "Part of it.", kZip},
                                       ResponseRow{304, "Unchanged.", kNothing}};
constexpr std::array kSheetAnswer = {ResponseRow{200, "The sheet.", kPng}};
constexpr std::array kImageAnswer = {ResponseRow{200, "The image.", kImages},
                                     ResponseRow{206, "Part of its bytes.", kImages},
                                     ResponseRow{304, "Unchanged.", kNothing}};
constexpr std::array kPixelAnswer = {ResponseRow{200, "The pixel.", kPixel}};
constexpr std::array kMeterAnswer = {ResponseRow{200, "The readings.", kMeter}};
constexpr std::array kMeterTableAnswer = {ResponseRow{200, "The readings as a table.", kCsv}};
constexpr std::array kConvergenceAnswer = {ResponseRow{200, "The curve.", kConvergence}};
constexpr std::array kObjectsAnswer = {ResponseRow{200, "The ids.", kObjects}};
constexpr std::array kEventsAnswer = {
    ResponseRow{200, "Server-sent events, until the job ends.", kEvents},
    ResponseRow{204, "Last-Event-ID was the end event: nothing will follow.", kNothing}};
constexpr std::array kJobPut = {
    ResponseRow{201, "Accepted.", kJob},
    ResponseRow{200, "The job created earlier by the same request.", kJob}};
constexpr std::array kWatchAnswer = {
    ResponseRow{200, "Server-sent events of all these jobs, until they have ended.", kEvents},
    ResponseRow{204, "Last-Event-ID included the end of every job: nothing will follow.",
                kNothing}};
constexpr std::array kTicketMade = {
    ResponseRow{201, "A ticket that is valid for one minute.", kTicket}};
constexpr std::array kTilesAnswer = {
    ResponseRow{200, "Tile frames, until the job ends.", kTiles},
    ResponseRow{204, "The job renders no image (its film is null).", kNothing}};
constexpr std::array kFilmAnswer = {ResponseRow{200, "The film.", kFilm},
                                    ResponseRow{206, "Part of it.", kFilm},
                                    ResponseRow{304, "Unchanged.", kNothing}};
constexpr std::array kMergeAnswer = {
    ResponseRow{201, "A finished job with the merged film.", kJob}};
constexpr std::array kComparisonAnswer = {ResponseRow{201, "The comparison.", kComparison}};
constexpr std::array kMetersCompared = {ResponseRow{200, "The comparison.", kMeterComparison}};
constexpr std::array kComparisonKept = {ResponseRow{200, "The comparison.", kComparison}};
constexpr std::array kMapAnswer = {ResponseRow{200, "The map.", kPng},
                                   ResponseRow{206, "Part of it.", kPng},
                                   ResponseRow{304, "Unchanged.", kNothing}};
constexpr std::array kLabAnswer = {
    ResponseRow{200, "JSON lines: a LabPoint for each completed n, then a LabOutcome.", kLines}};
constexpr std::array kKeyListAnswer = {ResponseRow{200, "The keys.", kKeyList}};
constexpr std::array kKeyMade = {ResponseRow{201, "The key, with its text.", kIssuedKey}};
constexpr std::array kDrainAnswer = {ResponseRow{200, "The state of draining.", kDrain}};
constexpr std::array kWorkersAnswer = {ResponseRow{200, "The workers.", kWorkerList}};
constexpr std::array kWorkerTilesAnswer = {ResponseRow{200, "The tiles.", kWorkerTiles}};
constexpr std::array kOrdersAnswer = {ResponseRow{200, "Orders for the worker.", kWorkerOrders}};
constexpr std::array kInputsAnswer = {ResponseRow{200, "The inputs.", kInputs}};
constexpr std::array kLeaseAnswer = {ResponseRow{200, "The unit's slices.", kBytes}};
constexpr std::array kWorkDone = {
    ResponseRow{204, "Done, by this or an earlier request.", kNothing}};
constexpr std::array kUsageAnswer = {ResponseRow{200, "The usage.", kUsage}};
constexpr std::array kDeliveryAnswer = {ResponseRow{200, "The call.", kDelivery}};
constexpr std::array kDeliveryBegun = {
    ResponseRow{202, "The call will be sent at once.", kDelivery}};
constexpr std::array kDeliveryListAnswer = {
    ResponseRow{200, "Calls, newest first.", kDeliveryList}};
constexpr std::array kSecretAnswer = {ResponseRow{200, "The secret.", kWebhookSecret}};

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
constexpr Headers kNoHeaders = {};
constexpr Contents kNoBody = {};
constexpr std::span<const int> kNoProblems = {};

constexpr std::array kOperations = {
    Operation{"getLiveness", "GET", "/livez", "Service", "Liveness check.",
              "Responds even while everything else is busy.", "", kNoHeaders, kNoBody, kTextAnswer,
              kNoProblems, true},
    Operation{"getReadiness", "GET", "/readyz", "Service", "Readiness check.",
              "503 while the server is starting or stopping. A line `storage_full: ...` follows "
              "while the disk is full: requests that need space are refused with 507, rendering "
              "jobs pause, and everything else works.",
              "", kNoHeaders, kNoBody, kReadyAnswer, kNoProblems, true},
    Operation{"getMetrics", "GET", "/metrics", "Service", "Prometheus metrics.",
              "If the operator has set `--metrics-key`, it is required as the bearer token.", "",
              kNoHeaders, kNoBody, kTextAnswer, kMetricsProblems, true},
    Operation{"getOpenApi", "GET", "/openapi.json", "Service", "This document.", "", "", kNoHeaders,
              kNoBody, kDocumentAnswer, kNoProblems, true},
    Operation{"getDocs", "GET", "/docs", "Service",
              "This document as a page on which requests can be tried.", "", "", kNoHeaders,
              kNoBody, kPageAnswer, kNoProblems, true},
    Operation{"getPage", "GET", "/", "Service", "The web page.", "", "", kNoHeaders, kNoBody,
              kPageAnswer, kNoProblems, true},
    Operation{"createSession", "POST", "/v1/session", "Service", "Exchange a key for a cookie.",
              "Send the key as the bearer token. The cookie is random, belongs to this browser "
              "alone, and expires after a week or with its key.",
              "", kNoHeaders, kNoBody, kSessionMade, kSessionProblems, true},
    Operation{"deleteSession", "DELETE", "/v1/session", "Service", "End the session of the cookie.",
              "", "", kNoHeaders, kNoBody, kSessionEnded, kNoProblems, true},
    Operation{"getServer", "GET", "/v1/server", "Service", "Server capabilities.",
              "Version, build, limits, and all names that a job can use.", "read", kNoHeaders,
              kNoBody, kServerAnswer, kNoProblems, true},
    Operation{"getDrain", "GET", "/v1/drain", "Service", "Get whether the server is draining.", "",
              "admin", kNoHeaders, kNoBody, kDrainAnswer, kNoProblems, true},
    Operation{
        "startDrain", "PUT", "/v1/drain", "Service", "Drain the server.",
        "Refuses new jobs with 503; running jobs continue, queued ones wait. Ends on restart.",
        "admin", kNoHeaders, kNoBody, kDrainAnswer, kNoProblems, true},
    Operation{"endDrain", "DELETE", "/v1/drain", "Service", "Accept jobs again.", "", "admin",
              kNoHeaders, kNoBody, kDrainAnswer, kNoProblems, true},
    Operation{"createAsset", "POST", "/v1/assets", "Assets", "Upload a file.",
              "Raw bytes of any file. The id is the sha256 of the content. 422 for an image that "
              "is cut short or damaged, and for other content with an `image/` type.",
              "write", kNoHeaders, kBytes, kAssetMade, kPutProblems, true},
    Operation{"putAsset", "PUT", "/v1/assets/{sha256}", "Assets", "Upload a file under its hash.",
              "422 if the content has a different hash, or for an image that is cut short or "
              "damaged, or other content with an `image/` type.",
              "write", kNoHeaders, kBytes, kAssetMade, kPutProblems, true},
    Operation{"getAsset", "GET", "/v1/assets/{sha256}", "Assets", "Download a file.",
              "Immutable; may be cached indefinitely.", "read", kFileHeaders, kNoBody,
              kAssetContent, kContentProblems, true},
    Operation{"deleteAsset", "DELETE", "/v1/assets/{sha256}", "Assets", "Delete a file.",
              "409 while a scene or job uses it.", "write", kNoHeaders, kNoBody, kGone,
              kRetryProblems, true},
    Operation{"createScene", "POST", "/v1/scenes", "Scenes", "Upload a scene.",
              "A GLB, a glTF without other files, a zip, or asset ids. GLB and zip are recognized "
              "by their first bytes, whatever type is given. Other formats, named by their type "
              "(`model/stl`) or by `name`, are converted; 415 where the server cannot. All files "
              "that it refers to are required; 424 lists missing ones.",
              "write", kNoHeaders, kSceneBodies, kSceneMade, kSceneProblems, true,
              &scene_upload_parameters},
    Operation{"listScenes", "GET", "/v1/scenes", "Scenes", "List scenes.", "", "read", kNoHeaders,
              kNoBody, kSceneListAnswer, k400, true, &scene_list_parameters},
    Operation{"getScene", "GET", "/v1/scenes/{id}", "Scenes", "Describe a scene.", "", "read",
              kNoHeaders, kNoBody, kSceneAnswer, k404, true},
    Operation{"deleteScene", "DELETE", "/v1/scenes/{id}", "Scenes", "Delete a scene.",
              "409 if a job uses it.", "write", kNoHeaders, kNoBody, kGone, kRetryProblems, true},
    Operation{"getSceneGltf", "GET", "/v1/scenes/{id}/gltf", "Scenes",
              "Download a built-in scene as GLB.", "", "read", kNoHeaders, kNoBody, kGlbAnswer,
              k404, true},
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
        "write", kNoHeaders, kRenderBodies, kRendered, kRenderProblems, true, &render_parameters},
    Operation{"renderDrake", "POST", "/v1/drake/render", "Jobs",
              "Render for Drake's MakeRenderEngineGltfClient.",
              "Drake's glTF render protocol; with `tessera serve --drake` also at `/render`. "
              "color: a PNG, rendered as by POST /v1/render, whose query parameters apply and "
              "belong to the client's render_endpoint; without preset, the light is `tent`. depth: "
              "a TIFF of one float per pixel, metres along the camera's axis, infinite from "
              "max_depth on, 0 up to min_depth. label: a PNG of the materials' base colours, white "
              "where there is nothing. Depths and labels are those of the surface at the pixel's "
              "centre. The scene and the job are deleted once they are answered.",
              "write", kNoHeaders, kDrakeBodies, kDrakeAnswer, kRenderProblems, true,
              &render_parameters},
    Operation{"createJob", "POST", "/v1/jobs", "Jobs", "Submit a job.",
              "Only `scene` is required. Unknown members are refused.", "write", kSubmitHeaders,
              kJobBodies, kJobMade, kSubmitProblems, true, &submit_parameters},
    Operation{"putJob", "PUT", "/v1/jobs/{id}", "Jobs", "Submit a job with a client-chosen id.",
              "The id is a UUID. The same body again: 200 and no second job; another body: 409.",
              "write", kNoHeaders, kJobRequest, kJobPut, kSubmitProblems, true},
    Operation{"listJobs", "GET", "/v1/jobs", "Jobs", "List jobs.", "", "read", kNoHeaders, kNoBody,
              kJobListAnswer, k400, true, &job_list_parameters},
    Operation{"getJob", "GET", "/v1/jobs/{id}", "Jobs", "Get a job, or wait for it to finish.", "",
              "read", kConditional, kNoBody, kJobAnswer, k404Or422, true, &wait_parameters},
    Operation{"patchJob", "PATCH", "/v1/jobs/{id}", "Jobs", "Change a job.",
              "A merge patch (RFC 7396) of priority, labels, name, stop and paused.", "write",
              kPatchHeaders, kJobPatch, kJobChanged, kPatchProblems, true},
    Operation{"cancelJob", "POST", "/v1/jobs/{id}/cancel", "Jobs", "Cancel a job.",
              "Keeps the image so far. Cancelling twice is not an error.", "write", kNoHeaders,
              kNoBody, kJobChanged, kCancelProblems, true},
    Operation{"retryJob", "POST", "/v1/jobs/{id}/retry", "Jobs", "Retry a failed or doubted job.",
              "A failed one continues from its last complete checkpoint, if any; a finished one "
              "that is `doubted` begins again. 409 for others, for `merged` ones, and if the scene "
              "was deleted.",
              "write", kNoHeaders, kNoBody, kJobRetried, kRetryProblems, true},
    Operation{"extendJob", "POST", "/v1/jobs/{id}/extend", "Jobs", "Extend a finished job.", "",
              "write", kNoHeaders, kExtend, kJobExtended, kExtendProblems, true},
    Operation{"deleteJob", "DELETE", "/v1/jobs/{id}", "Jobs", "Delete a job and its files.",
              "409 while it runs.", "write", kNoHeaders, kNoBody, kGone, kRetryProblems, true},
    Operation{"putPreset", "PUT", "/v1/presets/{name}", "Presets", "Store a preset.",
              "A job template for POST /v1/render?preset=NAME and for images by URL. Names are the "
              "tenant's own; those of studio lights are taken. A job that places the camera is "
              "refused, since the angles are those of the URL. Caches that hold an image of an "
              "older preset keep it: give a changed preset another name.",
              "write", kNoHeaders, kPresetBody, kPresetMade, kPresetProblems, true},
    Operation{"listPresets", "GET", "/v1/presets", "Presets", "List the presets.",
              "With the ready ones: hero, packshot, turntable and thumbnail. A preset stored under "
              "such a name replaces it.",
              "read", kNoHeaders, kNoBody, kPresetListAnswer, kNoProblems, true},
    Operation{"getPreset", "GET", "/v1/presets/{name}", "Presets", "Get a preset.", "", "read",
              kNoHeaders, kNoBody, kPresetAnswer, k404, true},
    Operation{"deletePreset", "DELETE", "/v1/presets/{name}", "Presets", "Delete a preset.",
              "Its URLs are 404 from then on; jobs of its images remain.", "write", kNoHeaders,
              kNoBody, kGone, k404, true},
    Operation{"createSigningKey", "POST", "/v1/signing-keys", "Presets",
              "Make a key that signs URLs of images.",
              "It signs for its tenant: the tenant's presets, scenes and quotas. The key is shown "
              "only once.",
              "write", kNoHeaders, kNoBody, kSigningKeyMade, k409Alone, true},
    Operation{"listSigningKeys", "GET", "/v1/signing-keys", "Presets", "List the signing keys.",
              "Without their texts.", "write", kNoHeaders, kNoBody, kSigningKeyListAnswer,
              kNoProblems, true},
    Operation{"deleteSigningKey", "DELETE", "/v1/signing-keys/{id}", "Presets",
              "Delete a signing key.", "URLs that it signed are 403 from then on.", "write",
              kNoHeaders, kNoBody, kGone, k404, true},
    Operation{"getPicture", "GET", "/i/{signature}/{preset}/{scene}/{view}", "Presets",
              "Get an image by its URL.",
              "Needs no key, and pages of all origins may use it. Each distinct image is one job "
              "of the preset's tenant, for all clients. Until the job ends, answers are the image "
              "as it is after the preset's `deadline_seconds`, with `Cache-Control: no-store`, or "
              "503 if some pixel has no sample yet, the server is busy, or as many jobs as URLs "
              "may start (`url_jobs_of_a_preset`, `url_jobs_of_a_key` of the limits) have not "
              "ended; the final image is `immutable`. If the job fails, the answer is its reason, "
              "with `Retry-After`, and it is not tried again for five minutes.",
              "", kConditional, kNoBody, kPictureAnswer, kUrlProblems, true,
              &picture_url_parameters},
    Operation{"createBatch", "POST", "/v1/batches", "Batches", "Submit jobs that vary a template.",
              "Creates all jobs or none. Jobs with the same scene share it in "
              "memory.",
              "write", kBatchHeaders, kBatchBody, kBatchMade, kSubmitProblems, true,
              &batch_submit_parameters},
    Operation{"listBatches", "GET", "/v1/batches", "Batches", "List batches.",
              "A batch is deleted with its last job.", "read", kNoHeaders, kNoBody,
              kBatchListAnswer, k400, true, &batch_list_parameters},
    Operation{"getBatch", "GET", "/v1/batches/{id}", "Batches", "Get a batch.", "", "read",
              kNoHeaders, kNoBody, kBatchAnswer, k404, true},
    Operation{"cancelBatch", "POST", "/v1/batches/{id}/cancel", "Batches",
              "Cancel the unfinished jobs.", "", "write", kNoHeaders, kNoBody, kBatchAnswer,
              kCancelProblems, true},
    Operation{"retryBatch", "POST", "/v1/batches/{id}/retry", "Batches",
              "Retry the failed and doubted jobs.",
              "As by POST /v1/jobs/{id}/retry. 409 when there are none.", "write", kNoHeaders,
              kNoBody, kBatchRetried, kRetryProblems, true},
    Operation{"deleteBatch", "DELETE", "/v1/batches/{id}", "Batches",
              "Delete a batch and its jobs.", "409 while one of its jobs is active.", "write",
              kNoHeaders, kNoBody, kGone, kRetryProblems, true},
    Operation{"getBatchArchive", "GET", "/v1/batches/{id}/archive.zip", "Batches",
              "Download the images of a batch.",
              "A zip with one file for each job that has an image. 409 while a job has not ended; "
              "410, with the names, if films were evicted. Has a length, and honours Range, up to "
              "100 megapixels of images; larger archives are sent while they are made.",
              "read", kFileHeaders, kNoBody, kArchiveAnswer, kArchiveProblems, true,
              &archive_parameters},
    Operation{"getBatchSheet", "GET", "/v1/batches/{id}/sheet.png", "Batches",
              "Get the images of a batch on one sheet.",
              "In the order of the jobs, row by row; white where there is no image yet.", "read",
              kRangeHeaders, kNoBody, kSheetAnswer, kSheetProblems, true, &sheet_parameters},
    Operation{"getImage", "GET", "/v1/jobs/{id}/image{.format}", "Results",
              "Get the rendered image (partial while the job is running).",
              "The format follows from the extension (png, jpg, webp, avif, exr, hdr, tif) or from "
              "Accept.",
              "read", kFileHeaders, kNoBody, kImageAnswer, kImageProblems, true, &image_parameters},
    Operation{"getPixel", "GET", "/v1/jobs/{id}/pixels/{x}/{y}", "Results",
              "Get one pixel with its intervals.", "", "read", kNoHeaders, kNoBody, kPixelAnswer,
              kPixelProblems, true},
    Operation{"getConvergence", "GET", "/v1/jobs/{id}/convergence", "Results",
              "Get the error over samples and time.", "", "read", kNoHeaders, kNoBody,
              kConvergenceAnswer, k404, true},
    Operation{"getMeter", "GET", "/v1/jobs/{id}/meter", "Results",
              "Get the irradiance at the meter's points.",
              "409 before every point has a sample; 404 for a job without a meter.", "read",
              kNoHeaders, kNoBody, kMeterAnswer, kSampledProblems, true},
    Operation{"getMeterTable", "GET", "/v1/jobs/{id}/meter.csv", "Results",
              "Get the irradiance as CSV.", "", "read", kNoHeaders, kNoBody, kMeterTableAnswer,
              kSampledProblems, true},
    Operation{"getObjects", "GET", "/v1/jobs/{id}/objects", "Results",
              "Get the meaning of layer ids.",
              "409 before the first sample; 404 also if the scene was deleted.", "read", kNoHeaders,
              kNoBody, kObjectsAnswer, kSampledProblems, true},
    Operation{
        "getFilm", "GET", "/v1/jobs/{id}/film", "Results", "Download the film (raw sample sums).",
        "Only for jobs that have ended. Little endian; `TSRFILM1`, u32 bytes of head, ledger and "
        "text, u32 bytes of the text, u32 ranges, u32 flags (1: auxiliary values; 2: errors of "
        "neighbours are correlated), i32 full width, full height, crop x, y, width, height, u32 "
        "replicates, u32 tiles, u64 bytes of the file, sha256 of the content (hex). Then 24 bytes "
        "per range of samples: u64 seed, u32 first replicate, replicates, samples, 0. Then the "
        "text (JSON: spec, build, error, warnings), zeros up to a multiple of 8. Then the tiles: "
        "i32 x, y, u32 samples, 0, u64 rejected samples, rays, f64 CPU seconds; for each pixel and "
        "replicate f32 mean r, g, b, alpha, M2 of the luminance, u32 count; with flag 1 for each "
        "pixel f32 albedo, normal, depth, u32 hits; with flags 8, 16 and 32 ids and mattes. "
        "Finally the sha256 (hex) of everything before.",
        "read", kFileHeaders, kNoBody, kFilmAnswer, kFilmProblems, true},
    Operation{
        "mergeFilms", "POST", "/v1/films/merge", "Results", "Merge films.",
        "Films of jobs that have ended, or film files uploaded as assets. Their jobs may differ "
        "only in seed, replicates, stop rules and names (422). Common samples are refused (409). "
        "Replicates are put side by side: jobs that hold replicates 0 to 1 and 2 to 3 of a seed "
        "give the film of the one job with four, bit for bit (auxiliary layers to rounding); other "
        "seeds count as further independent replicates. The weights are the sample counts.",
        "write", kNoHeaders, kMerge, kMergeAnswer, kMergeProblems, true},
    Operation{"streamEvents", "GET", "/v1/jobs/{id}/events", "Streams", "Watch a job.",
              "Events: snapshot, state, progress, tile, warning, end; reset after a loss; "
              "overloaded at the limit of streams.",
              "read", kEventsHeaders, kNoBody, kEventsAnswer, k404, true, &job_events_parameters},
    Operation{"watchJobs", "GET", "/v1/events", "Streams", "Watch several jobs on one connection.",
              "The events of each job, with `job` in their data.", "read", kEventsHeaders, kNoBody,
              kWatchAnswer, k404Or422, true, &events_parameters},
    Operation{"createStreamTicket", "POST", "/v1/stream-tickets", "Streams",
              "Create a short-lived stream ticket (valid for one minute).",
              "Added as `?ticket=` to events, tiles or image, it replaces the key, which pages "
              "cannot send with an EventSource or an image.",
              "read", kNoHeaders, kTicketRequest, kTicketMade, kTicketProblems, true},
    Operation{"streamTiles", "GET", "/v1/jobs/{id}/tiles", "Streams", "Stream tiles.",
              "Frames, little endian: `T S R 1`, u32 payload bytes, u32 revision, u16 x, y, width, "
              "height, u32 flags, f32 relative error, u32 CRC-32 of the payload; then planes of "
              "float32, r g b, their variances, the sample count. Flag 1: end frame; 2: correlated "
              "errors (zsobol, restir); 4: an alpha plane comes last; 8: planes of float16, r g b "
              "only, at most 65504 (planes=mean); 16: denoised (`?denoise=`): r g b, alpha by 4.",
              "read", kNoHeaders, kNoBody, kTilesAnswer, k404Or422, true, &tiles_parameters},
    Operation{"createComparison", "POST", "/v1/comparisons", "Results", "Compare two images.",
              "Two jobs that have ended, or a job and an uploaded image (8 and 16 bits are read as "
              "sRGB, as this server writes them with `curve=srgb`, floats as linear; it counts as "
              "exact except for its rounding). b is the reference. The interval of the bias comes "
              "from the halves of both, and for a job whose pixels have correlated errors (zsobol, "
              "restir) from the means of its replicates (with two of them it is wide); z is the "
              "difference of the luminances in standard errors, pooled over 3 x 3 pixels. Both "
              "assume that the two are independent, which jobs with a common seed are not.",
              "write", kNoHeaders, kComparisonRequest, kComparisonAnswer, kMergeProblems, true},
    Operation{"compareMeters", "GET", "/v1/comparisons", "Results",
              "Compare the meters of two jobs.",
              "At each point the difference a - b with its interval, as if the two were "
              "independent. 409 if their points differ, or one has no reading yet.",
              "read", kNoHeaders, kNoBody, kMetersCompared, kPixelProblems, true,
              &meter_comparison_parameters},
    Operation{"getComparison", "GET", "/v1/comparisons/{id}", "Results", "Get a comparison.", "",
              "read", kNoHeaders, kNoBody, kComparisonKept, k404, true},
    Operation{"getComparisonMap", "GET", "/v1/comparisons/{id}/{map}", "Results",
              "Get a comparison image (difference, z or FLIP).",
              "`difference.png`: blue where a is darker, red where it is brighter; the root of |a "
              "- b| / sqrt(b^2 + 0.01). `z.png`: the same colours from -5 to 5 standard errors. "
              "`flip.png`: 0 black to 1 pale yellow.",
              "read", kFileHeaders, kNoBody, kMapAnswer, kContentProblems, true},
    Operation{
        "runExperiment", "POST", "/v1/lab/runs", "Laboratory", "Run an experiment.",
        "Runs trials with the renderer's own classes at each n. The same request gives the same "
        "lines, except for `seconds` and `efficiency`, which are measured. Closing the connection "
        "cancels the run. 429 while `lab_runs` others run, or `lab_runs_of_a_key` of the same key.",
        "write", kNoHeaders, kLabRequest, kLabAnswer, kLabProblems, true},
    Operation{"listDeliveries", "GET", "/v1/webhooks/deliveries", "Webhooks", "List webhook calls.",
              "Pending calls and, for a week, earlier ones.", "read", kNoHeaders, kNoBody,
              kDeliveryListAnswer, k400Or422, true, &delivery_list_parameters},
    Operation{"getDelivery", "GET", "/v1/webhooks/deliveries/{id}", "Webhooks",
              "Get a webhook call.", "", "read", kNoHeaders, kNoBody, kDeliveryAnswer, k404, true},
    Operation{"redeliver", "POST", "/v1/webhooks/deliveries/{id}/redeliver", "Webhooks",
              "Repeat a webhook call.", "At once, with the same id and body, in any state.",
              "write", kNoHeaders, kNoBody, kDeliveryBegun, k404, true},
    Operation{"testWebhook", "POST", "/v1/webhooks/test", "Webhooks", "Send a test call.",
              "One signed call of type `test`, without retries; its delivery reports the outcome.",
              "write", kNoHeaders, kWebhookTest, kDeliveryBegun, kTestProblems, true},
    Operation{"getWebhookSecret", "GET", "/v1/webhooks/secret", "Webhooks",
              "Get the signing secret.",
              "Each tenant has its own. Calls are signed as defined by Standard Webhooks 1.0.",
              "write", kNoHeaders, kNoBody, kSecretAnswer, kNoProblems, true},
    Operation{"replaceWebhookSecret", "POST", "/v1/webhooks/secret", "Webhooks",
              "Create a new signing secret.",
              "For all later calls. 409 for the operator's, which is set by a flag or a file.",
              "write", kNoHeaders, kNoBody, kSecretAnswer, k409Alone, true},
    Operation{"listKeys", "GET", "/v1/keys", "Keys", "List the keys.", "Without their texts.",
              "admin", kNoHeaders, kNoBody, kKeyListAnswer, kNoProblems, true},
    Operation{"createKey", "POST", "/v1/keys", "Keys", "Create a key.",
              "403 on a server without keys: create the first one with `tessera keys add`.",
              "admin", kNoHeaders, kKeyRequest, kKeyMade, kTestProblems, true},
    Operation{"deleteKey", "DELETE", "/v1/keys/{id}", "Keys", "Remove a key.",
              "It stops working within a second; objects created with it stay with its tenant.",
              "admin", kNoHeaders, kNoBody, kGone, k404, true},
    Operation{"listWorkers", "GET", "/v1/workers", "Workers", "List the workers.", "", "read",
              kNoHeaders, kNoBody, kWorkersAnswer, kNoProblems, true},
    Operation{"listWorkerTiles", "GET", "/v1/jobs/{id}/workers", "Workers",
              "List the workers' tiles.", "Tiles of the job that are being rendered.", "read",
              kNoHeaders, kNoBody, kWorkerTilesAnswer, k404, true},
    Operation{"reportWorker", "PUT", "/v1/workers/{id}", "Workers", "Report a worker's state.", "",
              "worker", kNoHeaders, kWorkerReport, kOrdersAnswer, kSubmitProblems, true},
    Operation{"getWorkInputs", "GET", "/v1/work/jobs/{id}", "Workers", "Get a job's inputs.",
              "404 without open units.", "worker", kNoHeaders, kNoBody, kInputsAnswer, k404, true},
    Operation{"getWorkFile", "GET", "/v1/work/jobs/{id}/files/{sha256}", "Workers",
              "Get an input file.", "", "worker", kNoHeaders, kNoBody, kAssetContent,
              kContentProblems, true},
    Operation{"leaseUnit", "POST", "/v1/work/units/{id}/lease", "Workers", "Lease a unit.", "",
              "worker", kNoHeaders, kUnitRequest, kLeaseAnswer, kSubmitProblems, true},
    Operation{"putUnitResult", "PUT", "/v1/work/units/{id}/results/{worker}", "Workers",
              "Send the result of a unit.", "422 if it cannot be the unit's result.", "worker",
              kNoHeaders, kBytes, kWorkDone, kSubmitProblems, true},
    Operation{"handBackUnit", "POST", "/v1/work/units/{id}/hand-back", "Workers", "Return a unit.",
              "", "worker", kNoHeaders, kUnitRequest, kWorkDone, kSubmitProblems, true},
    Operation{
        "getUsage", "GET", "/v1/usage", "Keys", "Get the usage of tenants.",
        "All tenants for the operator and keys with scope `admin`; otherwise only the key's own.",
        "read", kNoHeaders, kNoBody, kUsageAnswer, kNoProblems, true},
};

}  // namespace

std::span<const Operation> operations() { return kOperations; }

}  // namespace api
