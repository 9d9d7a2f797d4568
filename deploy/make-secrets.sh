#!/bin/sh
# Makes the secrets of deploy/compose.yaml: a password of PostgreSQL, a key of the S3-compatible store, and the files
# that hand them to each container. Keeps them if they exist.
#
#   sh deploy/make-secrets.sh [FOLDER]      FOLDER: default deploy/secrets
#
# The folder keeps other users of this machine out. In a container, its user must be able to read its files.
set -eu
folder=${1:-$(dirname "$0")/secrets}

if [ -e "$folder" ]; then
    printf 'secrets: kept as they are: %s\n' "$folder"
    exit 0
fi

random() { od -An -N24 -tx1 /dev/urandom | tr -d ' \n'; }

umask 022
mkdir -m 700 "$folder.new"
password=$(random)
key=$(random)
printf '%s' "$password" >"$folder.new/postgres-password"
printf 'database = "postgres://flockreel:%s@postgres/flockreel"\n' "$password" >"$folder.new/flockreel.toml"
printf '[default]\naws_access_key_id = flockreel\naws_secret_access_key = %s\n' "$key" >"$folder.new/s3-credentials"
cat >"$folder.new/seaweedfs.json" <<JSON
{"identities": [{"name": "flockreel", "actions": ["Admin", "Read", "Write", "List", "Tagging"],
  "credentials": [{"accessKey": "flockreel", "secretKey": "$key"}]}]}
JSON
mv "$folder.new" "$folder"
printf 'secrets: made: %s\n' "$folder"
