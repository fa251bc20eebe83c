# The service in an image that holds the program, the C library and the certificates that webhooks are
# verified with: no shell, no package manager, no root. Run it with a read-only root file system; everything that it writes goes to /data:
#
#     docker build -t noctule .
#     docker run --read-only -p 127.0.0.1:8080:8080 -v noctule:/data noctule
#
# Where its port is published decides who can use it: as above, only this machine. To let others use it,
# give it keys: docker run -v ./keys.toml:/keys.toml:ro -e NOCTULE_KEYS_FILE=/keys.toml -p 8080:8080 ...

# Not the slim variant, which has a C compiler but no make.
FROM rust:1-bookworm AS builder
WORKDIR /build

# Only the libraries, so that this layer is built again only when they change.
COPY .cargo .cargo
COPY Cargo.toml Cargo.lock ./
RUN mkdir src benches \
    && touch src/lib.rs \
    && echo 'fn main() {}' >src/main.rs \
    && cp src/main.rs benches/engine.rs \
    && cargo build --release --locked \
    && rm -r src

COPY src src
COPY openapi.yaml ./
COPY docs docs
COPY scenarios scenarios
# Cargo compares modification times, and the copied files may be older than the build above.
RUN touch src/lib.rs src/main.rs \
    && cargo build --release --locked \
    && mkdir /data

# The same Debian release as the builder, and so the same C library.
FROM gcr.io/distroless/cc-debian12:nonroot
LABEL org.opencontainers.image.title="noctule" \
      org.opencontainers.image.description="Plans routes for unmanned aircraft over HTTP" \
      org.opencontainers.image.licenses="MIT OR Apache-2.0"
COPY --from=builder /build/target/release/noctule /usr/local/bin/noctule
COPY LICENSE-MIT LICENSE-APACHE /usr/share/doc/noctule/
COPY --from=builder --chown=65532:65532 /data /data
VOLUME /data
# The variables of settings, so that those of a container override them, and `noctule store` looks at the same place.
# Nobody can reach the loopback of a container from outside. With keys, the switch changes nothing.
ENV NOCTULE_DATA_DIR=/data \
    NOCTULE_LISTEN=0.0.0.0:8080 \
    NOCTULE_ALLOW_ANONYMOUS=true
# For SQLite's temporary files, because the root file system may be read-only.
ENV SQLITE_TMPDIR=/data
# A number, so that an orchestrator can see that it is not root.
USER 65532:65532
EXPOSE 8080
STOPSIGNAL SIGTERM
HEALTHCHECK --interval=10s --timeout=5s --start-period=10s CMD ["noctule", "healthcheck"]
ENTRYPOINT ["noctule"]
CMD ["serve"]
