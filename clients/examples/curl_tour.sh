#!/bin/sh
# A tour of the API with curl: what the server can do, a job, its image, its errors, a scene of
# one's own.
#   clients/examples/curl_tour.sh [FOLDER]      TESSERA_SERVER, TESSERA_KEY say which server
set -eu
cd "${1:-.}"
server=${TESSERA_SERVER:-http://127.0.0.1:8080}

# One request; any status but success ends the script.
call() {
  path=$1
  shift
  curl -fsS ${TESSERA_KEY:+-H "Authorization: Bearer $TESSERA_KEY"} "$server$path" "$@"
}
# A member of the JSON on stdin: member id, member error.low
member() {
  python3 -c 'import functools, json, sys
print(functools.reduce(lambda part, name: part[name], sys.argv[1].split("."),
  json.load(sys.stdin)))' "$1"
}

echo "Tessera $(call /v1/server | member version)"

# Submit. Sending it twice with the same key makes one job.
job=$(call /v1/jobs -H 'Content-Type: application/json' -H "Idempotency-Key: tour-$$" -d '{
  "scene": "cornell-box",
  "film": {"width": 160, "height": 90},
  "stop": {"relative_error": 0.15}
}' | member id)
echo "job $job"

# Watch it: server-sent events until the end.
call "/v1/jobs/$job/events" -N | sed -n 's/^event: //p' | sort | uniq -c

# The error comes with its interval.
call "/v1/jobs/$job?wait=25" >job.json
echo "relative error $(member error.relative <job.json)," \
  "95% between $(member error.low <job.json) and $(member error.high <job.json)"

# The image, its error as an image, everything as EXR, one pixel, the course of the error.
call "/v1/jobs/$job/image.png?exposure=0.5" -o image.png
call "/v1/jobs/$job/image.png?layer=error" -o error.png
call "/v1/jobs/$job/image.exr" -o all.exr
call "/v1/jobs/$job/pixels/80/45" -o pixel.json
call "/v1/jobs/$job/convergence" -o convergence.json

# More of the same image.
call "/v1/jobs/$job/extend" -H 'Content-Type: application/json' \
  -d '{"stop": {"samples_per_pixel": 64}}' -o /dev/null
call "/v1/jobs/$job?wait=25" >job.json
echo "$(member state <job.json) with $(member progress.samples_per_pixel.mean <job.json) samples"

# A scene of one's own goes up as a file.
call /v1/scenes/glass/gltf -o glass.glb
scene=$(call /v1/scenes -H 'Content-Type: model/gltf-binary' --data-binary @glass.glb | member id)
call /v1/jobs -H 'Content-Type: application/json' -H 'Prefer: wait=25' -d '{
  "scene": "'"$scene"'",
  "film": {"width": 80, "height": 45},
  "stop": {"samples_per_pixel": 8}
}' | member state

# Mistakes are answered with their place. Without -f, curl shows the answer.
curl -sS ${TESSERA_KEY:+-H "Authorization: Bearer $TESSERA_KEY"} "$server/v1/jobs" \
  -H 'Content-Type: application/json' \
  -d '{"scene": "cornell-box", "film": {"width": 0}}' >problem.json
member errors <problem.json
