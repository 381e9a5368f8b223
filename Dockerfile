FROM debian:bookworm-slim

RUN apt-get update \
    && apt-get install -y --no-install-recommends python3 python3-venv libegl1 libgl1-mesa-dri \
    && rm -rf /var/lib/apt/lists/*

RUN useradd --system --uid 10001 --home-dir /var/lib/cogmap cogmap \
    && install -d -o cogmap -g cogmap /var/lib/cogmap /var/lib/cogmap/runs

COPY requirements/run.txt requirements/build.txt /opt/cogmap/requirements/
RUN python3 -m venv /opt/cogmap/venv \
    && /opt/cogmap/venv/bin/pip install --no-cache-dir \
        -r /opt/cogmap/requirements/run.txt -r /opt/cogmap/requirements/build.txt

COPY . /opt/cogmap/source
RUN /opt/cogmap/venv/bin/pip install --no-cache-dir --no-deps --no-build-isolation /opt/cogmap/source

ENV PATH=/opt/cogmap/venv/bin:$PATH PYTHONUNBUFFERED=1
USER cogmap
WORKDIR /var/lib/cogmap
# The map of a drive is drawn with these fonts: each container would look for them anew, and say so.
RUN python -c 'import matplotlib.font_manager'
ENTRYPOINT ["cogmap"]
