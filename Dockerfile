# syntax=docker/dockerfile:1
# Two stages on the same Debian release, so that the C library matches. `builder` builds the program with the
# page embedded. The second stage contains the program, ffmpeg and curl. scripts/system-packages.sh lists the
# packages, as for `make`.

FROM rust:1.95-slim-bookworm AS builder
SHELL ["/bin/sh", "-euc"]
WORKDIR /src
COPY scripts scripts
RUN scripts/system-packages.sh build vendor && rm -rf /var/lib/apt/lists/*
COPY web web
RUN scripts/vendor.sh
COPY . .
RUN cargo build --release --locked --bin flockreel

FROM debian:bookworm-slim
COPY scripts/system-packages.sh /usr/local/sbin/system-packages
RUN /usr/local/sbin/system-packages run health \
    && rm -rf /var/lib/apt/lists/* \
    && useradd --system --uid 10001 --user-group --no-create-home flockreel \
    && install -d -o flockreel -g flockreel /data
COPY --from=builder /src/target/release/flockreel /usr/local/bin/flockreel
USER 10001:10001
VOLUME /data
# `docker run -p` reaches only a service that listens on all addresses of the container. Such a service asks every
# client for a token. `docker exec CONTAINER flockreel token create --name NAME` makes the first one
# (docs/how-to/run-in-containers.md).
ENV FLOCKREEL_BIND=0.0.0.0:8080 FLOCKREEL_AUTH=required FLOCKREEL_DATA=/data
EXPOSE 8080
HEALTHCHECK --interval=30s --timeout=5s --start-period=20s \
    CMD ["curl", "-fsS", "-o", "/dev/null", "http://127.0.0.1:8080/healthz"]
STOPSIGNAL SIGTERM
ENTRYPOINT ["flockreel"]
CMD ["serve"]
