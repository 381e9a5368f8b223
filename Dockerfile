# Two images: `cogmap` has all but the OpenGL which draws the camera images of a simulated town, and
# `sim` has that too.
#
# A tag may name another image tomorrow. Where there is a registry, build on one digest, which
# `docker buildx imagetools inspect debian:bookworm-slim` tells:
#   COGMAP_BASE=debian@sha256:... docker compose build
ARG BASE=debian:bookworm-slim
FROM ${BASE} AS system

RUN apt-get update \
    && apt-get install -y --no-install-recommends python3 \
    && apt-get clean \
    && rm -rf /var/lib/apt/lists/* /var/cache/apt /usr/share/doc /usr/share/man /usr/share/locale

RUN useradd --system --uid 10001 --home-dir /var/lib/cogmap cogmap \
    && install -d -o cogmap -g cogmap /var/lib/cogmap /var/lib/cogmap/runs

# The folders of keys, each of which a volume begins as: whoever runs the containers may write there.
RUN for name in authority sim player sensory epam workspace codelets global_workspace memory \
        procedural action motor operator observer recorder drive replay ros2 router; \
    do install -d -m 1777 /var/lib/cogmap/keys/$name; done


FROM system AS build

RUN apt-get update && apt-get install -y --no-install-recommends python3-venv binutils

# Of each package what was published under that version, or nothing.
COPY requirements/run.hashes.txt /opt/cogmap/requirements/
RUN python3 -m venv /opt/cogmap/venv \
    && /opt/cogmap/venv/bin/pip install --no-cache-dir --no-compile --require-hashes \
        -r /opt/cogmap/requirements/run.hashes.txt

# What no drive needs of the libraries: their tests, pybullet's robots and examples, symbols for
# debuggers, and the copy of ONNX's runtime for programs in C.
RUN cd /opt/cogmap/venv/lib/python3*/site-packages \
    && rm -rf pybullet_data pybullet_envs pybullet_examples pybullet_robots pybullet_utils \
    && rm -f onnxruntime/capi/libonnxruntime.so.* \
    && find . -type d -name tests -prune -exec rm -rf {} + \
    && find . -name '*.so' -not -path '*.libs/*' -exec strip --strip-unneeded {} +

COPY . /opt/cogmap/source
RUN /opt/cogmap/venv/bin/pip install --no-cache-dir --no-deps --no-build-isolation --no-compile \
        /opt/cogmap/source \
    && /opt/cogmap/venv/bin/pip uninstall --yes setuptools pip \
    && python3 -m compileall -q /opt/cogmap/venv/lib


# In one layer, without what was removed from those below.
FROM scratch AS cogmap

COPY --from=system / /
COPY --from=build /opt/cogmap/venv /opt/cogmap/venv

# A user who owns the folder of the runs may have any number, and has a home here too. Where the
# root file system is read-only, what draws keeps its list of fonts here as well.
ENV PATH=/opt/cogmap/venv/bin:/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin \
    HOME=/tmp \
    MPLCONFIGDIR=/tmp/matplotlib \
    PYTHONUNBUFFERED=1
LABEL org.opencontainers.image.title="Cogmap" \
    org.opencontainers.image.description="LIDA's cognitive architecture with spatial memory, as message-bus microservices" \
    org.opencontainers.image.version="0.3.0" \
    org.opencontainers.image.authors="The Cogmap maintainers"
USER cogmap
WORKDIR /var/lib/cogmap
ENTRYPOINT ["cogmap"]


FROM cogmap AS sim

USER root
RUN apt-get update \
    && apt-get install -y --no-install-recommends libegl1 libgl1-mesa-dri \
    && apt-get clean \
    && rm -rf /var/lib/apt/lists/* /var/cache/apt /usr/share/doc
USER cogmap
