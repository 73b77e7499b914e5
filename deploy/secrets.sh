#!/bin/sh
# Makes the passwords that docker-compose.yml reads, where there are none yet.
set -eu
folder="$(dirname "$0")/secrets"
# The container of the database reads it as another user, also where a checkout keeps its files from others.
[ ! -e "$(dirname "$0")/postgres-init.sh" ] || chmod a+r "$(dirname "$0")/postgres-init.sh"
# Containers run as other users: the folder keeps people of this machine out, the files let containers read.
mkdir -p -m 700 "$folder"
# api_keys: what a caller of the engines' services has to show; more keys, one a line, may follow.
for name in postgres_password prefect_database_password mlflow_database_password api_keys; do
  [ -e "$folder/$name" ] || (umask 022 && od -An -N24 -tx1 /dev/urandom | tr -d ' \n' > "$folder/$name")
done
