#!/bin/sh
# Runs a command with its own PostgreSQL and its own S3-compatible store, both on loopback. Both stop when
# the command ends, and their data is deleted. PostgreSQL comes from the system packages, SeaweedFS from a
# wheel in target/scale-venv. The command finds the servers through FLOCKREEL_TEST_POSTGRES (where it creates
# its databases), FLOCKREEL_TEST_BUCKET and AWS_*. It connects over TLS with a certificate made for this run.
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

# Prints free ports. Port + 10000 is free too, because SeaweedFS also uses that one.
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

# Creates the certificate of both servers, and adds it to the certificates that the command trusts.
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
        # The data need not survive a power cut.
        as_postgres "$postgres/pg_ctl" -D rows -w -l "$folder/postgres.log" -o "-c listen_addresses=127.0.0.1 \
            -c port=$1 -c unix_socket_directories=$folder -c max_connections=400 -c fsync=off \
            -c ssl=on -c ssl_cert_file=$folder/certificate.pem -c ssl_key_file=$folder/key.pem" start >/dev/null
    )
    export FLOCKREEL_TEST_POSTGRES="postgres://postgres@127.0.0.1:$1"
}

# Succeeds if a server listens on the port.
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
