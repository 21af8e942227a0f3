#include "server/store/schema.h"

#include <array>
#include <string>

namespace server {
namespace {

/// Row n migrates version n to n + 1. Released rows never change; new ones are appended.
constexpr std::array kMigrations = {
    R"sql(
CREATE TABLE counters(name TEXT PRIMARY KEY, value INTEGER NOT NULL) WITHOUT ROWID;

CREATE TABLE jobs(
  sequence INTEGER PRIMARY KEY AUTOINCREMENT,
  id TEXT NOT NULL UNIQUE,
  spec TEXT NOT NULL,
  spec_version INTEGER NOT NULL,
  scene TEXT NOT NULL,
  environment_asset TEXT NOT NULL,
  priority INTEGER NOT NULL,
  state TEXT NOT NULL,
  stop_reason TEXT NOT NULL,
  created_at REAL NOT NULL,
  started_at REAL,
  finished_at REAL,
  warnings TEXT NOT NULL,
  failure_code INTEGER NOT NULL,
  failure_message TEXT NOT NULL,
  failure_where TEXT NOT NULL,
  film INTEGER NOT NULL,
  film_bytes INTEGER NOT NULL,
  film_digest TEXT NOT NULL,
  revision INTEGER NOT NULL,
  fraction REAL NOT NULL,
  samples_min INTEGER NOT NULL,
  samples_mean REAL NOT NULL,
  samples_max INTEGER NOT NULL,
  elapsed_seconds REAL NOT NULL,
  cpu_seconds REAL NOT NULL,
  rays INTEGER NOT NULL,
  rejected_samples INTEGER NOT NULL,
  peak_bytes INTEGER NOT NULL,
  error_rmse REAL,
  error_low REAL,
  error_high REAL,
  error_unreliable INTEGER NOT NULL
);
CREATE INDEX jobs_by_state ON jobs(state, sequence);
CREATE INDEX jobs_by_scene ON jobs(scene, state);
CREATE INDEX jobs_by_film ON jobs(film, finished_at);
CREATE INDEX jobs_by_environment ON jobs(environment_asset, state);

CREATE TABLE job_labels(
  job INTEGER NOT NULL REFERENCES jobs(sequence) ON DELETE CASCADE,
  name TEXT NOT NULL,
  value TEXT NOT NULL,
  PRIMARY KEY(job, name)
) WITHOUT ROWID;
CREATE INDEX job_labels_by_value ON job_labels(name, value, job);

CREATE TABLE events(
  job INTEGER NOT NULL REFERENCES jobs(sequence) ON DELETE CASCADE,
  stream INTEGER NOT NULL,
  seq INTEGER NOT NULL,
  type TEXT NOT NULL,
  data TEXT NOT NULL,
  PRIMARY KEY(job, stream, seq)
) WITHOUT ROWID;

CREATE TABLE idempotency(
  key TEXT PRIMARY KEY,
  body_hash TEXT NOT NULL,
  job TEXT NOT NULL,
  created_at REAL NOT NULL
) WITHOUT ROWID;
CREATE INDEX idempotency_by_time ON idempotency(created_at);

CREATE TABLE assets(
  id TEXT PRIMARY KEY,
  bytes INTEGER NOT NULL,
  uploaded INTEGER NOT NULL,
  created_at REAL NOT NULL
) WITHOUT ROWID;

CREATE TABLE scenes(
  sequence INTEGER PRIMARY KEY AUTOINCREMENT,
  id TEXT NOT NULL UNIQUE,
  description TEXT NOT NULL,
  facts TEXT NOT NULL,
  created_at REAL NOT NULL
);

CREATE TABLE scene_files(
  scene TEXT NOT NULL REFERENCES scenes(id) ON DELETE CASCADE,
  uri TEXT NOT NULL,
  asset TEXT NOT NULL,
  PRIMARY KEY(scene, uri)
) WITHOUT ROWID;
CREATE INDEX scene_files_by_asset ON scene_files(asset);
)sql",
    // For lists of all jobs that have a label, whatever its value.
    "CREATE INDEX job_labels_by_name ON job_labels(name, job);",
    // Keys, owners of jobs, expiry of jobs, and pending webhook calls.
    R"sql(
CREATE TABLE keys(
  id TEXT PRIMARY KEY,
  name TEXT NOT NULL,
  token_hash TEXT NOT NULL UNIQUE,
  session_hash TEXT NOT NULL UNIQUE,
  scopes TEXT NOT NULL,
  rate_limit INTEGER,
  created_at REAL NOT NULL,
  expires_at REAL
) WITHOUT ROWID;

CREATE TABLE job_owners(
  job INTEGER PRIMARY KEY REFERENCES jobs(sequence) ON DELETE CASCADE,
  owner TEXT NOT NULL
);
CREATE INDEX job_owners_by_owner ON job_owners(owner, job);

CREATE TABLE job_expiries(
  job INTEGER PRIMARY KEY REFERENCES jobs(sequence) ON DELETE CASCADE,
  delete_at REAL NOT NULL
);
CREATE INDEX job_expiries_by_time ON job_expiries(delete_at);

CREATE TABLE deliveries(
  id TEXT PRIMARY KEY,
  job TEXT NOT NULL,
  url TEXT NOT NULL,
  body TEXT NOT NULL,
  attempts INTEGER NOT NULL,
  next_at REAL NOT NULL
) WITHOUT ROWID;
CREATE INDEX deliveries_by_time ON deliveries(next_at);

CREATE INDEX idempotency_by_job ON idempotency(job);
)sql",
    // Builds and ledgers of films; comparisons.
    R"sql(
ALTER TABLE jobs ADD COLUMN build TEXT NOT NULL DEFAULT '';
ALTER TABLE jobs ADD COLUMN ledger TEXT NOT NULL DEFAULT '';
CREATE TABLE comparisons(
  sequence INTEGER PRIMARY KEY AUTOINCREMENT,
  id TEXT NOT NULL UNIQUE,
  body TEXT NOT NULL,
  bytes INTEGER NOT NULL,
  created_at REAL NOT NULL
);
)sql",
    // Storage used by each tenant; films being created or removed while their jobs' records do not
    // yet say so.
    R"sql(
ALTER TABLE assets ADD COLUMN owner TEXT NOT NULL DEFAULT '';
CREATE INDEX assets_by_owner ON assets(owner, bytes);
ALTER TABLE job_owners ADD COLUMN reserved_bytes INTEGER NOT NULL DEFAULT 0;
ALTER TABLE job_owners ADD COLUMN stored_bytes INTEGER NOT NULL DEFAULT 0;
UPDATE job_owners SET stored_bytes =
  COALESCE((SELECT film_bytes FROM jobs WHERE sequence=job AND film=1), 0);
CREATE INDEX job_owners_by_bytes ON job_owners(owner, stored_bytes);
CREATE INDEX jobs_by_film_bytes ON jobs(film, film_bytes);
CREATE TABLE loose_films(job TEXT PRIMARY KEY) WITHOUT ROWID;
)sql",
    // Text that jobs are searched by, apart from their records: searches may read all of it.
    R"sql(
CREATE TABLE job_titles(job INTEGER PRIMARY KEY REFERENCES jobs(sequence)
  ON DELETE CASCADE, title TEXT NOT NULL);
INSERT INTO job_titles(job, title)
  SELECT sequence, lower(COALESCE(NULLIF(iif(json_valid(spec), json_extract(spec, '$.name'), ''),
    ''), scene))
  FROM jobs;
)sql",
    // Whether an error chose a job's number of samples, and measurements made before rendering.
    R"sql(
ALTER TABLE jobs ADD COLUMN samples_by_error INTEGER NOT NULL DEFAULT 0;
ALTER TABLE jobs ADD COLUMN split_count INTEGER NOT NULL DEFAULT 0;
UPDATE jobs SET samples_by_error =
  max(CAST(round(samples_mean) AS INTEGER), 1) WHERE stop_reason='relative_error';
)sql",
    // Browser sessions: cookies that expire, replacing one permanent cookie per key.
    R"sql(
CREATE TABLE sessions(hash TEXT PRIMARY KEY, token_hash TEXT NOT NULL,
  ends_at REAL NOT NULL) WITHOUT ROWID;
)sql",
    // Tenants that own keys, assets, scenes and comparisons. Things created with a key belong to
    // the tenant named like the key; a scene or asset of unknown origin belongs to the operator,
    // and to those whose jobs use it. job_owners.owner holds tenants from here on.
    R"sql(
ALTER TABLE keys ADD COLUMN tenant TEXT NOT NULL DEFAULT '';
ALTER TABLE keys ADD COLUMN priority_max INTEGER NOT NULL DEFAULT 100;
UPDATE keys SET tenant=id;

CREATE TABLE asset_tenants(
  asset TEXT NOT NULL REFERENCES assets(id) ON DELETE CASCADE,
  tenant TEXT NOT NULL,
  created_at REAL NOT NULL,
  PRIMARY KEY(asset, tenant)
) WITHOUT ROWID;
CREATE INDEX asset_tenants_by_tenant ON asset_tenants(tenant, asset);
INSERT INTO asset_tenants(asset, tenant, created_at)
  SELECT id, owner, created_at FROM assets WHERE uploaded=1;
INSERT OR IGNORE INTO asset_tenants(asset, tenant, created_at)
  SELECT assets.id, job_owners.owner, assets.created_at FROM assets
  JOIN jobs ON environment_asset=assets.id JOIN job_owners ON job=jobs.sequence;

CREATE TABLE scene_tenants(
  sequence INTEGER PRIMARY KEY AUTOINCREMENT,
  scene TEXT NOT NULL REFERENCES scenes(id) ON DELETE CASCADE,
  tenant TEXT NOT NULL,
  description TEXT NOT NULL,
  created_at REAL NOT NULL,
  UNIQUE(scene, tenant)
);
CREATE INDEX scene_tenants_by_tenant ON scene_tenants(tenant, sequence);
INSERT INTO scene_tenants(sequence, scene, tenant, description, created_at)
  SELECT sequence, id,
    COALESCE((SELECT owner FROM scene_files JOIN assets ON assets.id=asset
    WHERE scene=scenes.id AND uri=''), ''),
    description, created_at FROM scenes;
INSERT OR IGNORE INTO scene_tenants(scene, tenant, description, created_at)
  SELECT DISTINCT scenes.id, job_owners.owner, description, scenes.created_at FROM scenes
  JOIN jobs ON scene=scenes.id JOIN job_owners ON job=jobs.sequence;

DROP INDEX assets_by_owner;
ALTER TABLE assets DROP COLUMN owner;
ALTER TABLE assets DROP COLUMN uploaded;
ALTER TABLE scenes DROP COLUMN description;

ALTER TABLE comparisons ADD COLUMN tenant TEXT NOT NULL DEFAULT '';
UPDATE comparisons SET tenant=COALESCE(
  (SELECT owner FROM jobs JOIN job_owners ON job=jobs.sequence
  WHERE jobs.id=json_extract(body, '$.a')),
  (SELECT owner FROM jobs JOIN job_owners ON job=jobs.sequence
  WHERE jobs.id=json_extract(body, '$.b')), '')
  WHERE json_valid(body);

UPDATE idempotency SET key='of ' || key WHERE key NOT GLOB 'put *';

CREATE TABLE deleted_work(tenant TEXT PRIMARY KEY, jobs INTEGER NOT NULL,
cpu_seconds REAL NOT NULL) WITHOUT ROWID;
CREATE TRIGGER keep_deleted_work BEFORE DELETE ON jobs BEGIN
  INSERT INTO deleted_work(tenant, jobs, cpu_seconds)
    VALUES(COALESCE((SELECT owner FROM job_owners WHERE job=old.sequence), ''), 1, old.cpu_seconds)
    ON CONFLICT(tenant) DO UPDATE SET jobs=jobs+1, cpu_seconds=cpu_seconds+excluded.cpu_seconds;
END;
)sql",
    // Webhook calls are kept after they end. Each is made for a tenant, which has its own secret.
    R"sql(
CREATE TABLE webhook_deliveries(
  sequence INTEGER PRIMARY KEY AUTOINCREMENT,
  id TEXT NOT NULL UNIQUE,
  tenant TEXT NOT NULL,
  job TEXT NOT NULL,
  event TEXT NOT NULL,
  url TEXT NOT NULL,
  receiver TEXT NOT NULL,
  body TEXT NOT NULL,
  state TEXT NOT NULL,
  attempts INTEGER NOT NULL,
  created_at REAL NOT NULL,
  next_at REAL NOT NULL,
  ended_at REAL,
  status INTEGER NOT NULL,
  detail TEXT NOT NULL
);
CREATE INDEX webhook_deliveries_by_state ON webhook_deliveries(state, receiver, sequence);
CREATE INDEX webhook_deliveries_by_job ON webhook_deliveries(job, sequence);
CREATE INDEX webhook_deliveries_by_tenant ON webhook_deliveries(tenant, sequence);
INSERT INTO webhook_deliveries(id, tenant, job, event, url, receiver, body, state,
attempts, created_at, next_at,
    status, detail)
  SELECT deliveries.id, COALESCE((SELECT owner FROM jobs JOIN job_owners ON job=sequence
  WHERE jobs.id=deliveries.job), ''),
    deliveries.job, CASE WHEN body LIKE '{"type":"job.end"%' THEN 'end' ELSE 'state' END, url,
    url, body, 'pending',
    attempts, next_at, next_at, 0, '' FROM deliveries ORDER BY next_at;
DROP TABLE deliveries;
CREATE TABLE webhook_secrets(tenant TEXT PRIMARY KEY, secret TEXT NOT NULL) WITHOUT ROWID;
)sql",
    // Why a job is paused; ended jobs in the order in which they expire.
    R"sql(
ALTER TABLE jobs ADD COLUMN pause_reason TEXT NOT NULL DEFAULT '';
UPDATE jobs SET pause_reason='requested' WHERE state='paused';
CREATE INDEX jobs_by_end ON jobs(finished_at);
)sql",
    // Batches: jobs submitted together; a batch is removed with its last job.
    R"sql(
CREATE TABLE batches(
  sequence INTEGER PRIMARY KEY AUTOINCREMENT,
  id TEXT NOT NULL UNIQUE,
  tenant TEXT NOT NULL,
  name TEXT NOT NULL,
  webhook TEXT NOT NULL,
  reported INTEGER NOT NULL,
  created_at REAL NOT NULL
);
CREATE INDEX batches_by_tenant ON batches(tenant, sequence);
CREATE TABLE batch_jobs(
  job INTEGER PRIMARY KEY REFERENCES jobs(sequence) ON DELETE CASCADE,
  batch INTEGER NOT NULL REFERENCES batches(sequence) ON DELETE CASCADE,
  place INTEGER NOT NULL,
  matrix_values TEXT NOT NULL
);
CREATE INDEX batch_jobs_by_batch ON batch_jobs(batch, place);
CREATE TRIGGER forget_empty_batch AFTER DELETE ON batch_jobs
  WHEN NOT EXISTS(SELECT 1 FROM batch_jobs WHERE batch=old.batch) BEGIN
  DELETE FROM batches WHERE sequence=old.batch;
END;
)sql",
    // Errors by another definition: those of jobs that ended before are unknown.
    R"sql(
ALTER TABLE jobs RENAME COLUMN error_rmse TO error_grain;
ALTER TABLE jobs RENAME COLUMN error_low TO error_doubt;
ALTER TABLE jobs RENAME COLUMN error_high TO error_reach;
ALTER TABLE jobs DROP COLUMN error_unreliable;
UPDATE jobs SET error_grain=NULL, error_doubt=NULL, error_reach=NULL;
)sql",
    // Errors of biased images, which were those of their noise, are now by comparison.
    R"sql(
UPDATE jobs SET error_grain=NULL, error_doubt=NULL, error_reach=NULL
  WHERE iif(json_valid(spec), json_extract(spec, '$.integrator.type'), '')
    IN ('sppm', 'photon-map', 'irradiance-cache');
)sql",
    "ALTER TABLE jobs ADD COLUMN light_not_found TEXT NOT NULL DEFAULT '';",
    // A job's record as one document with its checksum (-1: not written since); columns are what
    // queries need. Lines of warnings are separated by U+001E on their way into an
    // array; texts that are not JSON stay what they are.
    R"sql(
ALTER TABLE jobs ADD COLUMN record TEXT NOT NULL DEFAULT '';
ALTER TABLE jobs ADD COLUMN record_crc INTEGER NOT NULL DEFAULT -1;
UPDATE jobs SET record=json_object(
  'state', state,
  'pause_reason', pause_reason,
  'stop_reason', stop_reason,
  'created_at', CASE WHEN abs(created_at)<9e999 THEN json(printf('%!.17g', created_at)) END,
  'started_at', CASE WHEN abs(started_at)<9e999 THEN json(printf('%!.17g', started_at)) END,
  'finished_at', CASE WHEN abs(finished_at)<9e999 THEN json(printf('%!.17g', finished_at)) END,
  'spec_version', spec_version,
  'film', film,
  'film_bytes', film_bytes,
  'film_digest', film_digest,
  'peak_bytes', peak_bytes,
  'samples_by_error', samples_by_error,
  'split_count', split_count,
  'revision', revision,
  'fraction', CASE WHEN abs(fraction)<9e999 THEN json(printf('%!.17g', fraction)) END,
  'samples_min', samples_min,
  'samples_mean', CASE WHEN abs(samples_mean)<9e999 THEN json(printf('%!.17g', samples_mean)) END,
  'samples_max', samples_max,
  'elapsed_seconds', CASE WHEN abs(elapsed_seconds)<9e999 THEN json(printf('%!.17g',
    elapsed_seconds)) END,
  'cpu_seconds', CASE WHEN abs(cpu_seconds)<9e999 THEN json(printf('%!.17g', cpu_seconds)) END,
  'rays', rays,
  'rejected_samples', rejected_samples,
  'error_grain', CASE WHEN abs(error_grain)<9e999 THEN json(printf('%!.17g', error_grain)) END,
  'error_doubt', CASE WHEN abs(error_doubt)<9e999 THEN json(printf('%!.17g', error_doubt)) END,
  'error_reach', CASE WHEN abs(error_reach)<9e999 THEN json(printf('%!.17g', error_reach)) END,
  'spec', CASE WHEN json_valid(spec) THEN json(spec) ELSE spec END,
  'warnings', json('[' || CASE WHEN warnings='' THEN '' ELSE
    replace(json_quote(replace(rtrim(warnings, char(10)), char(10), char(30))), '\u001e', '","')
    END || ']'),
  'failure', CASE WHEN failure_message='' THEN NULL ELSE json_object('code', failure_code,
    'message', failure_message, 'where', failure_where) END,
  'build', CASE WHEN json_valid(build) THEN json(build) ELSE build END,
  'ledger', CASE WHEN json_valid(ledger) THEN json(ledger) ELSE ledger END,
  'light_not_found', CASE WHEN json_valid(light_not_found) THEN json(light_not_found) ELSE
    light_not_found END);
ALTER TABLE jobs DROP COLUMN spec;
ALTER TABLE jobs DROP COLUMN spec_version;
ALTER TABLE jobs DROP COLUMN priority;
ALTER TABLE jobs DROP COLUMN stop_reason;
ALTER TABLE jobs DROP COLUMN created_at;
ALTER TABLE jobs DROP COLUMN started_at;
ALTER TABLE jobs DROP COLUMN warnings;
ALTER TABLE jobs DROP COLUMN failure_code;
ALTER TABLE jobs DROP COLUMN failure_message;
ALTER TABLE jobs DROP COLUMN failure_where;
ALTER TABLE jobs DROP COLUMN film_digest;
ALTER TABLE jobs DROP COLUMN revision;
ALTER TABLE jobs DROP COLUMN fraction;
ALTER TABLE jobs DROP COLUMN samples_min;
ALTER TABLE jobs DROP COLUMN samples_mean;
ALTER TABLE jobs DROP COLUMN samples_max;
ALTER TABLE jobs DROP COLUMN elapsed_seconds;
ALTER TABLE jobs DROP COLUMN rays;
ALTER TABLE jobs DROP COLUMN rejected_samples;
ALTER TABLE jobs DROP COLUMN peak_bytes;
ALTER TABLE jobs DROP COLUMN error_grain;
ALTER TABLE jobs DROP COLUMN error_doubt;
ALTER TABLE jobs DROP COLUMN error_reach;
ALTER TABLE jobs DROP COLUMN build;
ALTER TABLE jobs DROP COLUMN ledger;
ALTER TABLE jobs DROP COLUMN samples_by_error;
ALTER TABLE jobs DROP COLUMN split_count;
ALTER TABLE jobs DROP COLUMN pause_reason;
ALTER TABLE jobs DROP COLUMN light_not_found;
)sql",
    // Presets, and keys that sign URLs of their images.
    R"sql(
CREATE TABLE presets(
  tenant TEXT NOT NULL,
  name TEXT NOT NULL,
  body TEXT NOT NULL,
  is_public INTEGER NOT NULL,
  created_at REAL NOT NULL,
  PRIMARY KEY(tenant, name)
) WITHOUT ROWID;
CREATE UNIQUE INDEX presets_public ON presets(name) WHERE is_public=1;
CREATE TABLE signing_keys(
  id TEXT PRIMARY KEY,
  key TEXT NOT NULL,
  tenant TEXT NOT NULL,
  created_at REAL NOT NULL
) WITHOUT ROWID;
)sql",
    // Workers that returned wrong results.
    R"sql(
CREATE TABLE suspended_workers(
  number INTEGER PRIMARY KEY,
  worker TEXT NOT NULL UNIQUE
);
)sql",
};

}  // namespace

int schema_version() { return static_cast<int>(kMigrations.size()); }

core::Status migrate(Database& database) {
  return database.transact([](Database::Session& session) -> core::Status {
    int version = 0;
    {
      Statement asked = session.prepare("PRAGMA user_version");
      if (asked.step()) {
        version = static_cast<int>(asked.integer(0));
      }
      if (const auto status = asked.status(); !status) {
        return status;
      }
    }
    if (version > schema_version()) {
      return core::Error{core::ErrorCode::kInternal,
                         "the data directory was written by a newer version (schema " +
                             std::to_string(version) + ", this one knows " +
                             std::to_string(schema_version()) + ")",
                         ""};
    }
    for (int next = version; next < schema_version(); ++next) {
      if (auto status = session.execute(kMigrations[static_cast<std::size_t>(next)]); !status) {
        return status;
      }
    }
    return session.execute(("PRAGMA user_version=" + std::to_string(schema_version())).c_str());
  });
}

}  // namespace server
