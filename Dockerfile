# GLoTouch-BT without an installation, on any system with Docker:
#   docker build -t glotouch .
#   docker run --rm -v "$PWD/runs:/app/runs" glotouch                      # the demo; its report is in runs/
#   docker run --rm -v "$PWD/runs:/app/runs" glotouch run survey --seed 1
# The page of --live listens on 127.0.0.1 inside the container only; open runs/.../report.html instead.
FROM python:3.11-slim
ENV MPLBACKEND=Agg PIP_DISABLE_PIP_VERSION_CHECK=1 PYTHONDONTWRITEBYTECODE=1
RUN apt-get update \
    && apt-get install --yes --no-install-recommends build-essential libgl1 libegl1 libglib2.0-0 \
    && rm -rf /var/lib/apt/lists/*
WORKDIR /app
COPY requirements.txt ./
RUN pip install --no-cache-dir --require-hashes -r requirements.txt
COPY . ./
RUN pip install --no-cache-dir --no-deps --no-build-isolation .
ENTRYPOINT ["glotouch"]
CMD ["run", "retrieve", "--set", "target=apple", "--seed", "0"]
